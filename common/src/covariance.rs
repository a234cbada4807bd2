//! Covariances of what is measured.

use serde::{Deserialize, Serialize};

/// A 2×2 covariance of a position (m²) or a velocity (m²/s²).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Covariance2 {
    /// Variance along x.
    pub xx: f64,
    /// Variance along y.
    pub yy: f64,
    /// Covariance of x and y.
    pub xy: f64,
}

impl Covariance2 {
    /// The same standard deviation in every direction, without correlation.
    #[inline]
    pub const fn isotropic(sigma: f64) -> Self {
        Self { xx: sigma * sigma, xy: 0.0, yy: sigma * sigma }
    }

    /// Finite and positive definite.
    pub fn is_valid(&self) -> bool {
        self.xx > 0.0
            && self.yy > 0.0
            && self.xx.is_finite()
            && self.yy.is_finite()
            && self.determinant() > 0.0
    }

    /// All elements multiplied by a factor.
    #[must_use]
    pub const fn scaled(&self, factor: f64) -> Self {
        Self { xx: self.xx * factor, xy: self.xy * factor, yy: self.yy * factor }
    }

    /// Determinant.
    #[inline]
    pub fn determinant(&self) -> f64 {
        self.xx * self.yy - self.xy * self.xy
    }

    /// The larger of the two marginal standard deviations.
    #[inline]
    pub fn max_sigma(&self) -> f64 {
        self.xx.max(self.yy).sqrt()
    }
}

/// Covariance of a box z = [x y w d θ]: no cross terms between position, width, depth and heading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoxCovariance {
    /// Of the centre, m².
    pub position: Covariance2,
    /// Variance of the width, m².
    pub ww: f64,
    /// Variance of the depth, m².
    pub dd: f64,
    /// Variance of the heading, rad².
    pub yaw: f64,
}

/// A measured velocity: components in the map frame with their covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Velocity {
    /// East, m/s.
    pub x: f64,
    /// North, m/s.
    pub y: f64,
    /// Covariance, m²/s².
    pub covariance: Covariance2,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_positive_definite_matrices_are_valid() {
        assert!(Covariance2::isotropic(0.3).is_valid());
        assert!(!Covariance2::isotropic(0.0).is_valid());
        assert!(!Covariance2 { xx: 1.0, xy: 1.0, yy: 1.0 }.is_valid());
        assert!(!Covariance2 { xx: f64::NAN, xy: 0.0, yy: 1.0 }.is_valid());
    }
}
