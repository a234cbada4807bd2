//! The innovation of a position: how far a measurement lies from the prediction.

use serde::{Deserialize, Serialize};
use v2x_common::covariance::Covariance2;

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

    /// -2 ln of the density, without its constant.
    pub fn minus_two_ln(&self) -> f64 {
        self.mahalanobis2 + libm::log(self.determinant)
    }
}
