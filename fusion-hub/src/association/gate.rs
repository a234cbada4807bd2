//! The gate: which pairs are candidates.

use crate::values::Measurement;
use crate::values::{ExpectedPlace, PredictedMeasurement};
use v2x_common::covariance::Covariance2;

/// A measurement's variance along an axis counts for no more than this in the gate, m²: one that is less certain than 6 m is
/// a candidate for the objects about it, and not for all.
const MOST_IN_GATE: f64 = 36.0;

/// The same of a track's, m²: an object that was not detected for seconds is searched for farther.
const MOST_OF_TRACK_IN_GATE: f64 = 144.0;

/// A measurement's covariance, as far as it counts for the gate, m².
pub(super) fn for_gate(z: &Measurement) -> Covariance2 {
    limited(&z.r, MOST_IN_GATE)
}

/// A track's covariance, as far as it counts for the gate, m².
pub(super) fn track_for_gate(track: &PredictedMeasurement) -> Covariance2 {
    limited(&track.gate_covariance, MOST_OF_TRACK_IN_GATE)
}

/// The same of a place by positions alone, m².
pub(super) fn place_for_gate(place: &ExpectedPlace) -> Covariance2 {
    limited(&place.covariance, MOST_OF_TRACK_IN_GATE)
}

fn limited(covariance: &Covariance2, limit: f64) -> Covariance2 {
    let most = covariance.xx.max(covariance.yy);
    if most > limit { covariance.scaled(limit / most) } else { *covariance }
}

/// The distance of a pair relative to both covariances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Separation {
    /// Squared Mahalanobis distance times `determinant`.
    scaled: f64,
    /// Of the innovation covariance, m⁴.
    pub determinant: f64,
}

impl Separation {
    /// Of a report from where its track is expected.
    pub(super) fn of(z: &Measurement, track: &PredictedMeasurement) -> Self {
        Self::by(&track.position_covariance, &z.r, z, track.position)
    }

    /// The same by the covariance for gates.
    pub(super) fn to_gate(z: &Measurement, track: &PredictedMeasurement) -> Self {
        Self::by(&track_for_gate(track), &for_gate(z), z, track.position)
    }

    /// Of a report from where positions alone expect its track.
    pub(super) fn of_place(z: &Measurement, place: &ExpectedPlace) -> Self {
        Self::by(&place.covariance, &z.r, z, place.position)
    }

    /// The same by the covariances for gates.
    pub(super) fn to_gate_of(z: &Measurement, place: &ExpectedPlace) -> Self {
        Self::by(&place_for_gate(place), &for_gate(z), z, place.position)
    }

    fn by(p: &Covariance2, r: &Covariance2, z: &Measurement, position: [f64; 2]) -> Self {
        let dx = z.position[0] - position[0];
        let dy = z.position[1] - position[1];
        let (xx, xy, yy) = (p.xx + r.xx, p.xy + r.xy, p.yy + r.yy);
        Self { scaled: dx * dx * yy - 2.0 * dx * dy * xy + dy * dy * xx, determinant: xx * yy - xy * xy }
    }

    /// Whether the squared Mahalanobis distance is at most `gate`.
    pub(super) fn is_within(&self, gate: f64) -> bool {
        self.scaled <= gate * self.determinant
    }

    /// Squared Mahalanobis distance, χ² with 2 degrees of freedom.
    pub(super) fn mahalanobis2(&self) -> f64 {
        self.scaled / self.determinant
    }
}

/// Squared distance of two positions, m².
pub(super) fn distance2(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![("association.most_in_gate_m2", format!("{MOST_IN_GATE}, of a track {MOST_OF_TRACK_IN_GATE}"))]
}
