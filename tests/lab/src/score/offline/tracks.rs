//! The ticks of a log as a sequence for the tracking metrics.

use crate::data::scene::TrueBox;
use crate::score::tracking::figures::TrackingFigures;
use crate::score::tracking::{Instant, ReportedBox, Sequence};
use v2x_common::fused::FusedObject;

/// The boxes of all ticks so far.
#[derive(Debug, Default)]
pub(super) struct Tracks {
    instants: Vec<Instant>,
}

impl Tracks {
    /// Adds the objects of one tick.
    pub(super) fn add(&mut self, objects: &[FusedObject], truth: Vec<TrueBox>) {
        // A log may have gaps of years. Instants without any box count for nothing.
        if objects.is_empty() && truth.is_empty() {
            return;
        }
        let reported = objects.iter().map(|object| ReportedBox {
            track: object.track.0,
            class: object.class,
            score: object.existence,
            bev: object.bev,
        });
        self.instants.push(Instant { truth, reported: reported.collect() });
    }

    /// The figures so far; none where a method reports a track twice at one time.
    pub(super) fn figures(&self) -> TrackingFigures {
        match Sequence::new(self.instants.clone()) {
            Ok(sequence) => TrackingFigures::of(&[sequence]),
            Err(error) => {
                tracing::warn!(%error, "no tracker's figures");
                TrackingFigures::default()
            }
        }
    }
}
