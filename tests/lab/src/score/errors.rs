//! The error of one estimate.

use crate::score::estimate::Estimate;
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::{BevBox, angle_difference};

/// The error of a box, by part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxError {
    /// East and north, m.
    pub position: [f64; 2],
    /// The shorter way around, rad.
    pub yaw: f64,
    /// Width and depth, m.
    pub size: [f64; 2],
}

/// How the length of the size error is rounded. Both are right to the last digit but one. Published results keep their
/// digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SizeNorm {
    /// The root of the sum of squares: the paper's tables, and sweeps.
    RootOfSquares,
    /// `hypot`: runs, and logs with their truth.
    Hypot,
}

impl BoxError {
    /// Estimate minus truth.
    pub fn between(estimate: &BevBox, truth: &BevBox) -> Self {
        Self {
            position: [estimate.x - truth.x, estimate.y - truth.y],
            yaw: angle_difference(estimate.yaw, truth.yaw),
            size: [estimate.w - truth.w, estimate.d - truth.d],
        }
    }

    /// Translation (m), dimension (m), orientation (degrees): eq. (5)-(7) of the paper.
    pub fn lengths(&self, size_norm: SizeNorm) -> [f64; 3] {
        let length = |[a, b]: [f64; 2]| libm::sqrt(a * a + b * b);
        let size = match size_norm {
            SizeNorm::RootOfSquares => length(self.size),
            SizeNorm::Hypot => libm::hypot(self.size[0], self.size[1]),
        };
        [length(self.position), size, self.yaw.abs().to_degrees()]
    }
}

/// Distance between the centres of two boxes, m.
pub(crate) fn distance_m(a: &BevBox, b: &BevBox) -> f64 {
    a.pose().distance_to(b.x, b.y)
}

/// `eᵀ S⁻¹ e / 2` of the position; `None` where S is no covariance.
pub(crate) fn half_nees(estimate: &Estimate, truth: &BevBox) -> Option<f64> {
    let s = &estimate.position;
    s.is_valid().then(|| nees(BoxError::between(&estimate.bev, truth).position, s) / 2.0)
}

/// `eᵀ S⁻¹ e` of two coordinates.
pub(crate) fn nees([x, y]: [f64; 2], s: &Covariance2) -> f64 {
    (s.yy * x * x - 2.0 * s.xy * x * y + s.xx * y * y) / s.determinant()
}
