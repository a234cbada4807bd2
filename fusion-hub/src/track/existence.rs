//! The probability that a track is of something real, as odds.

use v2x_common::time::Span;

/// Odds of 0.999: more certain than this nobody gets, so that a track can still die in time.
const MAX_ODDS: f64 = 999.0;
/// And less certain than this neither, so that a report can still revive it.
const MIN_ODDS: f64 = 1e-12;

/// Mean time that an object which nobody looks at keeps existing where it was predicted, s.
const SURVIVAL_TIME_S: f64 = 10.0;

/// Odds of existence, r / (1 − r).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Existence(f64);

impl Existence {
    /// From odds, of which ∞ is the most.
    pub fn from_odds(odds: f64) -> Self {
        Self(odds.clamp(MIN_ODDS, MAX_ODDS))
    }

    /// From a probability.
    pub fn from_probability(probability: f64) -> Self {
        Self::from_odds(probability / (1.0 - probability))
    }

    /// As a probability.
    pub fn probability(self) -> f64 {
        self.0 / (1.0 + self.0)
    }

    /// After a time in which the object may have gone: r' = r (1 − lost).
    pub fn survived(self, dt: Span) -> Self {
        let lost = -libm::expm1(-dt.abs().as_secs_f64() / SURVIVAL_TIME_S);
        Self::from_odds(self.0 * (1.0 - lost) / (1.0 + self.0 * lost))
    }

    /// After a report: the ratio of its density given the object to that of clutter, as a logarithm.
    pub fn reported(self, ln_likelihood_ratio: f64) -> Self {
        Self::from_odds(self.0 * libm::exp(ln_likelihood_ratio))
    }

    /// After a look that missed it, as it does with this probability.
    pub fn missed(self, miss_probability: f64) -> Self {
        Self::from_odds(self.0 * miss_probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_miss_is_bayes_rule() {
        let (r, p_detection) = (0.8, 0.95);
        let expected = r * (1.0 - p_detection) / (1.0 - r * p_detection);
        let missed = Existence::from_probability(r).missed(1.0 - p_detection);
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
        let mut existence = Existence::from_odds(f64::INFINITY);
        for _ in 0..3 {
            existence = existence.missed(0.05);
        }
        assert!(existence.probability() < 0.2);
    }

    #[test]
    fn a_certain_report_revives_what_was_as_good_as_dead() {
        let mut existence = Existence::from_probability(0.5);
        for _ in 0..10_000 {
            existence = existence.missed(0.001);
        }
        assert!(existence.reported(f64::INFINITY).probability() > 0.99);
    }
}
