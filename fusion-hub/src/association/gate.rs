//! The gate: which pairs are candidates.

use crate::values::Measurement;
use crate::values::PredictedMeasurement;
use v2x_common::covariance::Covariance2;

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
        Self::by(&track.position_covariance, z, track)
    }

    /// The same by the covariance for gates.
    pub(super) fn to_gate(z: &Measurement, track: &PredictedMeasurement) -> Self {
        Self::by(&track.gate_covariance, z, track)
    }

    fn by(p: &Covariance2, z: &Measurement, track: &PredictedMeasurement) -> Self {
        let dx = z.position[0] - track.position[0];
        let dy = z.position[1] - track.position[1];
        let (xx, xy, yy) = (p.xx + z.r.xx, p.xy + z.r.xy, p.yy + z.r.yy);
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
