//! The probability that a track is of something real, in log-odds.

use v2x_common::time::Span;

/// Log-odds of 0.999: more certain than this nobody gets, so that a track can still die in time.
const MAX_LOG_ODDS: f64 = 6.906_754_778_648_554;

/// Mean time that an object which nobody looks at keeps existing where it was predicted, s.
const SURVIVAL_TIME_S: f64 = 10.0;

/// Log-odds of existence.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Existence(f64);

impl Existence {
    /// From log-odds.
    pub fn from_log_odds(log_odds: f64) -> Self {
        Self(log_odds.min(MAX_LOG_ODDS))
    }

    /// From a probability in (0, 1).
    pub fn from_probability(probability: f64) -> Self {
        Self::from_log_odds(libm::log(probability / (1.0 - probability)))
    }

    /// As a probability.
    pub fn probability(self) -> f64 {
        1.0 / (1.0 + libm::exp(-self.0))
    }

    /// After a time in which the object may have gone.
    pub fn survived(self, dt: Span) -> Self {
        let lost = -libm::expm1(-dt.abs().as_secs_f64() / SURVIVAL_TIME_S);
        if lost <= 0.0 {
            return self;
        }
        // r' = r (1 − lost); odds r'/(1 − r') = odds (1 − lost) / (1 + odds · lost).
        let odds = libm::exp(self.0);
        Self(self.0 + libm::log1p(-lost) - libm::log1p(odds * lost))
    }

    /// After a report: the ratio of its density given the object to that of clutter, as a logarithm.
    pub fn reported(self, ln_likelihood_ratio: f64) -> Self {
        Self::from_log_odds(self.0 + ln_likelihood_ratio)
    }

    /// After a look that missed it, with this logarithm of the probability of a miss.
    pub fn missed(self, ln_miss: f64) -> Self {
        Self(self.0 + ln_miss)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_miss_is_bayes_rule() {
        let (r, p_detection) = (0.8, 0.95);
        let expected = r * (1.0 - p_detection) / (1.0 - r * p_detection);
        let missed = Existence::from_probability(r).missed(libm::log(1.0 - p_detection));
        assert!((missed.probability() - expected).abs() < 1e-12);
    }

    #[test]
    fn survival_takes_its_share_however_it_is_split() {
        let start = Existence::from_probability(0.9);
        let whole = start.survived(Span::from_millis(400));
        let split = start.survived(Span::from_millis(150)).survived(Span::from_millis(250));
        assert!((whole.probability() - 0.9 * libm::exp(-0.04)).abs() < 1e-12);
        assert!((whole.probability() - split.probability()).abs() < 1e-12);
    }

    #[test]
    fn certainty_is_bounded_so_that_three_misses_can_end_it() {
        let mut existence = Existence::from_log_odds(f64::INFINITY);
        for _ in 0..3 {
            existence = existence.missed(libm::log(0.05));
        }
        assert!(existence.probability() < 0.2);
    }
}
