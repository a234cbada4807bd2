//! Where no new object can be: at the place of one that is there already.

use super::predict::Predictions;
use super::store::TrackStore;
use crate::filter::Filter;
use crate::values::{Body, Measurement};
use v2x_common::geometry::BevBox;

/// The bodies of a frame's tracks, and of the detections that initiate tracks.
#[derive(Debug)]
pub(super) struct Occupied {
    bodies: Vec<Body>,
}

impl Occupied {
    /// By the tracks that are rather of real objects.
    pub(super) fn by<F: Filter>(predictions: &Predictions<F>, tracks: &TrackStore<F>) -> Self {
        let predicted = predictions.tracks().iter().zip(predictions.measurements());
        let real = predicted.filter(|(index, _)| tracks.get(**index).latest().is_rather_real());
        let bodies = real.filter_map(|(_, track)| {
            let ([x, y], [w, d], p) = (track.position, track.size, &track.position_covariance);
            Body::of(track.class, &BevBox { x, y, w, d, yaw: track.yaw }, p.xx.max(p.yy))
        });
        Self { bodies: bodies.collect() }
    }

    /// Whether a detection can be of a new object; it then takes its place.
    pub(super) fn admits(&mut self, z: &Measurement) -> bool {
        let ([x, y], [w, d]) = (z.position, z.size);
        let bev = BevBox { x, y, w, d, yaw: z.yaw };
        let Some(body) = Body::of(z.class, &bev, z.r.xx.max(z.r.yy)) else { return true };
        if self.bodies.iter().any(|other| other.is_same(&body)) {
            return false;
        }
        self.bodies.push(body);
        true
    }
}
