//! How an agent's errors of position differ from what it declares.

use super::Measurement;
use serde::{Deserialize, Serialize};

/// Differences from the declared covariances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

    /// Scales the covariance of a measurement.
    pub fn scale(&self, z: &mut Measurement) {
        if self.scale != 1.0 {
            z.r = z.r.scaled(self.scale);
        }
    }

    /// Adds the lasting part to the covariances of measurements, for association.
    pub fn add_lasting(&self, measurements: &mut [Measurement]) {
        if self.lasting > 0.0 {
            for z in measurements {
                z.r.xx += self.lasting;
                z.r.yy += self.lasting;
            }
        }
    }
}
