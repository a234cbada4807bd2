//! The innovation of a position: how far a measurement lies from the prediction.

use serde::{Deserialize, Serialize};
use v2x_common::covariance::Covariance2;

/// At least this share of a variance remains when noise is taken from it.
const LEAST_REMAINING: f64 = 1e-6;

/// The normalised innovation of a position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PositionInnovation {
    /// Squared Mahalanobis distance (NIS), χ² with 2 degrees of freedom.
    pub mahalanobis2: f64,
    /// Determinant of the innovation's covariance, m⁴.
    pub determinant: f64,
}

impl PositionInnovation {
    /// Of a difference (m) with this covariance (m²), which must be positive definite.
    #[inline]
    pub fn new([dx, dy]: [f64; 2], s: &Covariance2) -> Self {
        let determinant = s.determinant();
        let weighted = [s.yy * dx + dy * -s.xy, s.xx * dy + dx * -s.xy];
        Self { mahalanobis2: (dx * weighted[0] + dy * weighted[1]) / determinant, determinant }
    }

    /// The same difference with less noise (variance along an axis, m²), as if covariances were alike in all directions.
    #[must_use]
    pub fn with_less_noise(&self, less: f64) -> Self {
        let variance = libm::sqrt(self.determinant);
        let remaining = (variance - less).max(LEAST_REMAINING * variance);
        Self { mahalanobis2: self.mahalanobis2 * variance / remaining, determinant: remaining * remaining }
    }

    /// -2 ln of the density, without its constant.
    pub fn minus_two_ln(&self) -> f64 {
        self.mahalanobis2 + libm::log(self.determinant)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_less_noise_it_is_the_innovation_of_a_smaller_covariance() {
        let [dx, dy] = [0.4, -0.7];
        let of = |variance: f64| {
            PositionInnovation::new([dx, dy], &Covariance2 { xx: variance, yy: variance, xy: 0.0 })
        };
        let (less, expected) = (of(15.0).with_less_noise(14.5), of(0.5));
        assert!((less.mahalanobis2 - expected.mahalanobis2).abs() < 1e-12, "{less:?}");
        assert!((less.determinant - expected.determinant).abs() < 1e-12, "{less:?}");
        assert!(of(0.5).with_less_noise(0.6).minus_two_ln().is_finite());
    }
}
