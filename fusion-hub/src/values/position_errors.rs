//! How an agent's errors of position differ from what it declares.

use super::Measurement;
use v2x_common::covariance::Covariance2;

/// Differences from the declared covariances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionErrors {
    /// Factor on the declared variances.
    pub scale: f64,
    /// Variance along an axis of the part that lasts for seconds, m²: it does not average out over frames.
    pub lasting: f64,
}

impl Default for PositionErrors {
    fn default() -> Self {
        Self::AS_DECLARED
    }
}

impl PositionErrors {
    /// White, and as large as declared.
    pub const AS_DECLARED: Self = Self { scale: 1.0, lasting: 0.0 };

    /// A measurement with its covariance scaled.
    pub fn scaled(&self, z: Measurement) -> Measurement {
        if self.scale == 1.0 { z } else { Measurement { r: z.r.scaled(self.scale), ..z } }
    }

    /// A measurement whose covariance has the lasting part, too: for association.
    pub fn whole(&self, z: Measurement) -> Measurement {
        if self.lasting == 0.0 {
            return z;
        }
        let Covariance2 { xx, xy, yy } = z.r;
        Measurement { r: Covariance2 { xx: xx + self.lasting, xy, yy: yy + self.lasting }, ..z }
    }
}
