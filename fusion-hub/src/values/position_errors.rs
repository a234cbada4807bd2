//! How an agent's errors of position differ from what it declares.

use super::Measurement;
use serde::{Deserialize, Serialize};

/// Lasting errors change by so many times their own variance in a second: 2/τ of a process that forgets within τ = 2 s.
const WANDER_PER_S: f64 = 1.0;

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

    /// Variance along an axis, m², by which what an agent sees of an object has wandered from what the object does, in a time
    /// (s) between two reports: the errors that last as a first-order Gauss-Markov process (Gelb 1974, section 2.2). The state
    /// follows them; the variance that is published holds them in full.
    #[inline]
    pub fn wandered(&self, dt_s: f64) -> f64 {
        if self.lasting == 0.0 {
            return 0.0;
        }
        WANDER_PER_S * self.lasting * dt_s.abs().min(1.0 / WANDER_PER_S)
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

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> (&'static str, String) {
    ("errors.wander_per_s", WANDER_PER_S.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_errors_that_last_wander_and_by_no_more_than_they_are() {
        assert_eq!(PositionErrors::AS_DECLARED.wandered(10.0), 0.0);
        let errors = PositionErrors { scale: 1.0, lasting: 0.16 };
        assert!(
            (errors.wandered(0.1) - 0.016).abs() < 1e-12 && errors.wandered(-0.1) == errors.wandered(0.1)
        );
        assert_eq!(errors.wandered(60.0), 0.16);
    }
}
