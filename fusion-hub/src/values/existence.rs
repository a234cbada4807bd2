//! The probability that a track is of a real object, as odds.

use super::PositionInnovation;
use super::share_lost;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use v2x_common::time::Span;

/// Upper limit, odds of 0.9999.
const MAX_ODDS: f64 = 1e4;
/// Lower limit: a detection can still confirm the track again.
const MIN_ODDS: f64 = 1e-12;

/// Mean survival time of an object without coverage, s, at least.
pub const SURVIVAL_TIME_S: f64 = 60.0;
/// And this many intervals of the frames that detect it: between two frames little must be lost at any rate.
const SURVIVAL_FRAMES: f64 = 600.0;

/// What bounds existence: how certain it can be, and how soon it fades.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Persistence {
    /// Greatest odds.
    most_odds: f64,
    /// Mean survival time of an object, s.
    survival_time_s: f64,
}

impl Default for Persistence {
    fn default() -> Self {
        Self::BRIEF
    }
}

impl Persistence {
    /// Odds of 0.999 and 10 s: one missed detection of a sensor that hardly ever misses makes a track unlikely.
    pub const BRIEF: Self = Self { most_odds: 999.0, survival_time_s: 10.0 };

    /// Of what is detected by frames with this interval, s.
    pub fn by_rate(interval_s: f64) -> Self {
        Self { most_odds: MAX_ODDS, survival_time_s: SURVIVAL_TIME_S.max(SURVIVAL_FRAMES * interval_s) }
    }
}

/// A squared Mahalanobis distance, and something below e^(−½ of it).
const NEAR: f64 = 18.0;
const DENSITY_AT_NEAR: f64 = 1.2e-4;

/// Odds of existence, r / (1 − r).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Existence(f64);

impl Existence {
    /// From odds, of which ∞ is the most.
    pub fn from_odds(odds: f64) -> Self {
        Self(odds.clamp(MIN_ODDS, MAX_ODDS))
    }

    /// At most what these limits allow.
    pub fn within(self, persistence: &Persistence) -> Self {
        Self(self.0.min(persistence.most_odds))
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
    #[inline(always)]
    pub fn survived(self, dt: Span, persistence: &Persistence) -> Self {
        let lost = share_lost(dt.abs().as_secs_f64() / persistence.survival_time_s);
        Self::from_odds(self.0 * (1.0 - lost) / (1.0 + self.0 * lost))
    }

    /// The smoothed probability that it existed, given that of a time `dt` later: that it still existed then, or
    /// had gone in the meantime.
    pub fn existed(self, dt: Span, persistence: &Persistence, existed_later: f64) -> f64 {
        let before = self.probability();
        let gone = before * share_lost(dt.abs().as_secs_f64() / persistence.survival_time_s);
        existed_later + (1.0 - existed_later) * gone / (gone + 1.0 - before)
    }

    /// After a detection: times the ratio of its density given the object to that of clutter, where
    /// `detection_over_clutter` is in m² and ∞ without clutter.
    #[inline(always)]
    pub fn reported(self, innovation: &PositionInnovation, detection_over_clutter: f64) -> Self {
        let odds = self.0 * detection_over_clutter;
        // Most tracks are at the upper limit: then neither root nor exponential changes the result. The squares
        // of both sides of odds · e^(−m²/2) / 2π√det ≥ MAX_ODDS.
        let at_least = odds * (DENSITY_AT_NEAR / (2.0 * PI * MAX_ODDS));
        if innovation.mahalanobis2 <= NEAR && at_least * at_least >= innovation.determinant {
            return Self(MAX_ODDS);
        }
        if odds == f64::INFINITY {
            return Self(MAX_ODDS);
        }
        let density =
            libm::exp(-innovation.mahalanobis2 / 2.0) / (2.0 * PI * libm::sqrt(innovation.determinant));
        Self::from_odds(odds * density)
    }

    /// Less likely than not.
    pub fn is_unlikely(self) -> bool {
        self.0 < 1.0
    }

    /// After a detection that may also be of a new object, with these odds: a track of low existence must not make a
    /// detection worth less than it would be alone.
    pub fn or_initiated(self, birth_odds: f64) -> Self {
        Self::from_odds(self.0 + birth_odds)
    }

    /// Whether it is at the lower limit.
    pub fn is_least(self) -> bool {
        self.0 <= MIN_ODDS
    }

    /// After a missed detection, which has this probability.
    pub fn missed(self, miss_probability: f64) -> Self {
        Self::from_odds(self.0 * miss_probability)
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("existence.odds", format!("{MIN_ODDS} to {MAX_ODDS}; {:?} without learning", Persistence::BRIEF)),
        ("existence.survival_time_s", format!("{SURVIVAL_TIME_S}, at least {SURVIVAL_FRAMES} frames")),
        ("existence.near", format!("{NEAR}, {DENSITY_AT_NEAR}")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missed_detection_is_bayes_rule() {
        let (r, p_detection) = (0.8, 0.95);
        let expected = r * (1.0 - p_detection) / (1.0 - r * p_detection);
        let missed = Existence::from_probability(r).missed(1.0 - p_detection);
        assert!((missed.probability() - expected).abs() < 1e-12);
    }

    #[test]
    fn survival_does_not_depend_on_how_the_time_is_split() {
        let start = Existence::from_probability(0.9);
        let whole = start.survived(Span::from_millis(400), &Persistence::BRIEF);
        let split = start
            .survived(Span::from_millis(150), &Persistence::BRIEF)
            .survived(Span::from_millis(250), &Persistence::BRIEF);
        assert!((whole.probability() - 0.9 * libm::exp(-0.04)).abs() < 1e-12);
        assert!((whole.probability() - split.probability()).abs() < 1e-12);
    }

    #[test]
    fn four_missed_detections_make_a_certain_track_unlikely() {
        let mut existence = Existence::from_odds(f64::INFINITY);
        for _ in 0..4 {
            existence = existence.missed(0.05);
        }
        assert!(existence.probability() < 0.2);
    }

    #[test]
    fn a_detection_without_clutter_restores_the_existence_of_an_unlikely_track() {
        let mut existence = Existence::from_probability(0.5);
        for _ in 0..10_000 {
            existence = existence.missed(0.001);
        }
        let certain = PositionInnovation { mahalanobis2: 900.0, determinant: 1.0 };
        assert!(existence.reported(&certain, f64::INFINITY).probability() > 0.99);
    }

    #[test]
    fn a_detection_is_bayes_rule_with_and_without_saturation() {
        for (odds, mahalanobis2, over_clutter) in
            // From the second row on: just below and far below where the upper limit is certain.
            [
                (1e-6, 3.0, 1e3),
                (0.5, 0.1, 30.0),
                (5.0, 17.9, 1e7),
                (900.0, 17.9, 1e6),
                (0.1, 40.0, 1e9),
                (1.0, 17.9, 1e4),
                (1.0, 17.9, 2.8e6),
                (1.0, 17.9, 1.31e7),
                (1.0, 40.0, 1e13),
            ]
        {
            let innovation = PositionInnovation { mahalanobis2, determinant: 0.09 };
            let density = libm::exp(-mahalanobis2 / 2.0) / (2.0 * PI * 0.3);
            let expected = (odds * over_clutter * density).clamp(MIN_ODDS, MAX_ODDS);
            let found = Existence::from_odds(odds).reported(&innovation, over_clutter).0;
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} for {expected}");
        }
    }

    #[test]
    fn an_object_existed_that_exists_later_or_has_gone_since() {
        let before = Existence::from_probability(0.7);
        let dt = Span::from_millis(4000);
        // It had gone with 1 − e^(−0.4) where it had existed.
        let gone = 0.7 * (1.0 - libm::exp(-0.4));
        let absent_later = gone + 0.3;
        for later in [0.0, 0.25, 1.0] {
            let expected = later + (1.0 - later) * gone / absent_later;
            assert!((before.existed(dt, &Persistence::BRIEF, later) - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn even_odds_are_not_unlikely_and_the_lower_limit_is_least() {
        assert!(!Existence::from_probability(0.5).is_unlikely());
        assert!(Existence::from_probability(0.49).is_unlikely());
        assert!(Existence::from_odds(0.0).is_least() && !Existence::from_odds(2.0 * MIN_ODDS).is_least());
    }
}
