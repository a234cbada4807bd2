//! Where no new object can be: at the place of one that is there already.

use super::predict::Predictions;
use super::store::TrackStore;
use crate::filter::Filter;
use crate::values::{Body, Measurement};
use v2x_common::geometry::BevBox;

/// A detection that overlaps a track so much, where 1 is as much as two bodies can, is rather a second one of its object.
const MOST_WITH_TRACK: f64 = 0.5;

/// The bodies of a frame's tracks, and after them those of the detections that initiate tracks.
#[derive(Debug)]
pub(super) struct Occupied {
    bodies: Vec<Body>,
    n_tracks: usize,
}

impl Occupied {
    /// By the tracks that are rather of real objects.
    pub(super) fn by<F: Filter>(predictions: &Predictions<F>, tracks: &TrackStore<F>) -> Self {
        let predicted = predictions.tracks().iter().zip(predictions.measurements());
        let real = predicted.filter(|(index, _)| tracks.get(**index).latest().is_rather_real());
        let bodies = real.filter_map(|(_, track)| {
            let ([x, y], [w, d]) = (track.position, track.size);
            Body::of(track.class, &BevBox { x, y, w, d, yaw: track.yaw }, &track.position_covariance)
        });
        let bodies: Vec<Body> = bodies.collect();
        Self { n_tracks: bodies.len(), bodies }
    }

    /// Whether a detection can be of a new object; it then takes its place. A neighbour that errs towards
    /// a track is admitted in another frame.
    pub(super) fn admits(&mut self, z: &Measurement) -> bool {
        let ([x, y], [w, d]) = (z.position, z.size);
        let bev = BevBox { x, y, w, d, yaw: z.yaw };
        let Some(body) = Body::of(z.class, &bev, &z.r) else { return true };
        let (tracks, new) = self.bodies.split_at(self.n_tracks);
        let is_of_track = tracks.iter().any(|track| track.overlap(&body) >= MOST_WITH_TRACK);
        if is_of_track || new.iter().any(|other| other.overlap(&body) >= 1.0) {
            return false;
        }
        self.bodies.push(body);
        true
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![("tracker.most_with_track", MOST_WITH_TRACK.to_string())]
}
