//! How an agent's errors of position differ from what it declares.

use super::Measurement;
use serde::{Deserialize, Serialize};
use v2x_common::time::Timestamp;

/// Lasting errors are forgotten within τ, s.
const LASTS_S: f64 = 1.0;
/// So they change by so many times their own variance in a second: 2/τ.
const WANDER_PER_S: f64 = 2.0 / LASTS_S;
/// Agents do not send more often, s.
pub(super) const LEAST_INTERVAL_S: f64 = 1e-3;
/// An agent whose errors last less decides by how much the estimate wanders for so long after its last detection, s, and for so
/// many intervals of its frames.
const DECIDES_FOR_S: f64 = 1.0;
const DECIDES_INTERVALS: f64 = 3.0;

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

/// What lasts of the errors that an estimate holds: that of the agent which errs least of those that have seen the object of late.
///
/// It changes as a first-order Gauss-Markov process does (Gelb 1974, section 2.2), and the state follows it; the variance that is
/// published holds it in full. By another agent's larger errors the estimate does not wander.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LastingError {
    /// Variance along an axis, m².
    variance: f64,
    /// When the agent that errs least detected it, and the mean time between its frames, s.
    at: Timestamp,
    interval_s: f64,
    /// Its last detection by any agent.
    detected_at: Timestamp,
}

impl LastingError {
    /// After a first detection.
    pub const fn initial(errors: &PositionErrors, at: Timestamp, interval_s: f64) -> Self {
        Self { variance: errors.lasting, at, interval_s, detected_at: at }
    }

    /// Takes in a detection by an agent with this time between its frames (s); the variance along an axis (m²) by which the
    /// estimate has wandered since the last one.
    #[inline(always)]
    pub fn take_in(&mut self, errors: &PositionErrors, at: Timestamp, interval_s: f64) -> f64 {
        let decides_for_s = DECIDES_FOR_S.max(DECIDES_INTERVALS * self.interval_s);
        if errors.lasting <= self.variance || (at - self.at).abs().as_secs_f64() > decides_for_s {
            (self.variance, self.at, self.interval_s) = (errors.lasting, at, interval_s);
        }
        let passed = at - std::mem::replace(&mut self.detected_at, at);
        if self.variance == 0.0 {
            return 0.0;
        }
        self.variance * (WANDER_PER_S * passed.abs().as_secs_f64()).min(1.0)
    }

    /// After [`Self::take_in`]: the variance along an axis (m²) that is added to that of a report (`reported`), so that
    /// it counts for less than one of the agent which errs least. Errors that last do not average out: of n reports within 2τ that
    /// are worth one, each is worth 1/n of it. The agent that errs least is not discounted, for the state follows what lasts of its
    /// errors; the others are, relative to it.
    #[inline(always)]
    pub fn discount(&self, errors: &PositionErrors, interval_s: f64, reported: f64) -> f64 {
        if errors.lasting <= self.variance {
            return 0.0;
        }
        let reports = (2.0 * LASTS_S / interval_s.max(LEAST_INTERVAL_S)).max(1.0);
        reports * (errors.lasting - self.variance) * reported / (reported + reports * self.variance)
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> (&'static str, String) {
    (
        "errors.wander_per_s",
        format!(
            "{WANDER_PER_S} (for {LASTS_S} s), decided for {DECIDES_FOR_S} s and {DECIDES_INTERVALS} frames"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::time::Span;

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    const LASTS: PositionErrors = PositionErrors { scale: 1.0, lasting: 0.16 };

    #[test]
    fn only_errors_that_last_wander_and_by_no_more_than_they_are() {
        let mut white = LastingError::initial(&PositionErrors::AS_DECLARED, at(0), 0.1);
        assert_eq!(white.take_in(&PositionErrors::AS_DECLARED, at(10_000), 0.1), 0.0);
        let mut lasts = LastingError::initial(&LASTS, at(0), 0.1);
        assert!((lasts.take_in(&LASTS, at(100), 0.1) - 0.032).abs() < 1e-12);
        assert!((lasts.take_in(&LASTS, at(0), 0.1) - 0.032).abs() < 1e-12, "late");
        assert_eq!(lasts.take_in(&LASTS, at(60_000), 0.1), 0.16);
    }

    #[test]
    fn reports_with_larger_errors_that_last_count_for_less_and_those_of_the_best_agent_in_full() {
        let mut held = LastingError::initial(&LASTS, at(0), 0.1);
        held.take_in(&LASTS, at(100), 0.1);
        assert_eq!(held.discount(&LASTS, 0.1, 0.09), 0.0);
        assert_eq!(held.discount(&PositionErrors::AS_DECLARED, 0.1, 0.09), 0.0);
        let twice = PositionErrors { lasting: 0.32, ..LASTS };
        let discounted = 0.09 + held.discount(&twice, 0.1, 0.09);
        let expected = 0.09 * (0.09 + 20.0 * 0.32) / (0.09 + 20.0 * 0.16);
        assert!((discounted - expected).abs() < 1e-12, "{discounted} {expected}");
        let mut white = LastingError::initial(&PositionErrors::AS_DECLARED, at(0), 0.1);
        white.take_in(&LASTS, at(50), 0.1);
        assert!((white.discount(&LASTS, 0.1, 0.09) - 20.0 * 0.16).abs() < 1e-12);
        assert!(white.discount(&LASTS, 0.0, 0.09).is_finite());
    }

    #[test]
    fn what_an_agent_without_errors_that_last_sees_does_not_wander_by_those_of_another() {
        let mut held = LastingError::initial(&LASTS, at(0), 0.1);
        assert_eq!(held.take_in(&PositionErrors::AS_DECLARED, at(50), 0.1), 0.0);
        assert_eq!(held.take_in(&LASTS, at(100), 0.1), 0.0);
        assert!(held.take_in(&LASTS, at(2_000), 0.1) > 0.0, "once that one has not seen it for a while");
    }
}
