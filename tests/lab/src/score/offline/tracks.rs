//! The ticks of a log as a sequence for the metrics of tracking and detection.

use crate::data::scene::TrueBox;
use crate::score::detection::{DetectionScore, Scene, Velocities};
use crate::score::tracking::figures::TrackingFigures;
use crate::score::tracking::{Instant, ReportedBox, Sequence};
use v2x_common::fused::FusedObject;

/// The boxes of all ticks so far.
#[derive(Debug, Default)]
pub(super) struct Tracks {
    instants: Vec<Instant>,
    velocities: Vec<Velocities>,
}

impl Tracks {
    /// Adds the boxes of one tick: the true ones with their velocities (m/s) where these are known, and the objects.
    pub(super) fn add<'a>(
        &mut self,
        truth: impl Iterator<Item = (TrueBox, Option<[f64; 2]>)>,
        objects: impl Iterator<Item = &'a FusedObject>,
    ) {
        let (mut instant, mut velocities) = (Instant::default(), Velocities::default());
        for (one, velocity) in truth {
            instant.truth.push(one);
            velocities.truth.push(velocity);
        }
        for FusedObject { track, class, bev, velocity, existence, .. } in objects {
            instant.reported.push(ReportedBox {
                track: track.0,
                class: *class,
                score: *existence,
                bev: *bev,
            });
            velocities.reported.push(Some([velocity.0, velocity.1]));
        }
        // A log may have gaps of years. Instants without any box count for nothing.
        if !instant.reported.is_empty() || !instant.truth.is_empty() {
            self.instants.push(instant);
            self.velocities.push(velocities);
        }
    }

    /// The figures so far; none where a method reports a track twice at one time.
    pub(super) fn figures(&self) -> (TrackingFigures, DetectionScore) {
        match Sequence::new(self.instants.clone()) {
            Ok(sequence) => {
                let detection =
                    DetectionScore::of(&[Scene { sequence: &sequence, velocities: &self.velocities }]);
                (TrackingFigures::of(&[sequence]), detection)
            }
            Err(error) => {
                tracing::warn!(%error, "no tracker's figures");
                Default::default()
            }
        }
    }
}
