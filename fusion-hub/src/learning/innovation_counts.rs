//! Whether an agent's errors of position are white, and whether they are as large as declared.
//!
//! An error that lasts for seconds (a box is drawn around the seen side of a car, a pose drifts) shows in successive
//! innovations of one agent about one object: they are alike. It does not average out over frames, so it belongs into the
//! published covariance, once for each agent. Such innovations are of what positions alone predict: a filter that is bound to a
//! heading, or behind a manoeuvre, errs for longer itself.

use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// Innovations further apart are not compared.
const FORGOTTEN: Span = Span::from_millis(3000);
/// Pairs from which on something is concluded.
const LEAST_PAIRS: f64 = 50.0;
/// And with which it is known well.
const ENOUGH_PAIRS: f64 = 200.0;
/// Errors are coloured where successive innovations have more than this correlation.
const COLOURED: f64 = 0.2;
/// And more by so many standard deviations of that of white ones (two axes for each pair).
const CHANCE_SIGMAS: f64 = 1.5;
/// And where the variance of the prediction by positions is no more than so many times the declared one.
const MOST_BY_POSITIONS: f64 = 2.0;
/// And of objects whose path bends with less than this, m/s²: in a bend of constant radius whoever expects a straight path errs to the
/// same side each time.
const MOST_BENT: f64 = 1.5;
/// The lasting part of an error shows by half in the innovations of a filter that follows it.
const LASTING_SHARE: f64 = 2.0;
/// A declared variance is corrected where it is wrong by more than this factor, e^0.7, and within these limits.
const WRONG_BY: f64 = 0.7;
const SCALE_LIMITS: [f64; 2] = [0.02, 50.0];
/// Innovations tell of reports only where the variance of the prediction is no more than so many times the (corrected) declared one.
const MOST_OF_PREDICTION: f64 = 1.0;
/// A correction is at least this share of the ratio of what is seen to all that is expected: where declared variances are too large,
/// those of the predictions, which are made of reports, are too large with them.
const LEAST_OF_OVERALL: f64 = 0.5;
/// Unit of sums, m²: whole numbers add up to the same in any order.
const UNITS: f64 = 65_536.0;
/// Most that one innovation adds, m².
const MOST: f64 = 100.0;
/// An innovation counts for no more than so many standard deviations: it may be of a manoeuvre, or of another object.
const CLIPPED_AT: f64 = 3.0;
/// Mean of the logarithm of a squared innovation of two axes over twice its variance: -γ (Euler) of an exponential law. The
/// logarithm is robust against outliers.
const MEAN_LN: f64 = -0.577_215_664_901_532_9;
/// The smallest such ratio.
const LEAST_RATIO: f64 = 1e-6;

/// An innovation of a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Innovation {
    pub(super) at: Timestamp,
    /// m.
    pub(super) difference: [f64; 2],
    /// Mean variance of the prediction along an axis, m².
    pub(super) predicted: f64,
    /// The same of the measurement, as it was declared.
    pub(super) declared: f64,
    /// The difference from what positions alone predict, m: nothing that is learnt here changes these predictions.
    pub(super) by_positions: [f64; 2],
    /// Mean variance of that prediction along an axis, m².
    pub(super) predicted_by_positions: f64,
    /// Acceleration across the object's path, m/s².
    pub(super) bent: f64,
    /// Whether no other agent has detected the object.
    pub(super) is_alone: bool,
}

impl Innovation {
    /// The difference from what positions predict, no longer than is credible, m.
    fn clipped(&self) -> [f64; 2] {
        let most2 = CLIPPED_AT * CLIPPED_AT * (self.predicted_by_positions + self.declared);
        let length2 = product(self.by_positions, self.by_positions);
        let factor = if length2 > most2 { libm::sqrt(most2 / length2) } else { 1.0 };
        self.by_positions.map(|axis| axis * factor)
    }
}

/// Sums over the innovations of one agent, m².
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct InnovationCounts {
    all: f64,
    /// Those of objects that no other agent has detected.
    alone: f64,
    /// Of logarithms of squared innovations over their expected variance.
    logarithms: f64,
    predicted: f64,
    declared: f64,
    /// Pairs of successive innovations of one object.
    pairs: f64,
    pair_squares: f64,
    products: f64,
}

/// What is kept of an agent's last innovation about an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LastInnovation {
    at: Timestamp,
    /// m.
    clipped: [f64; 2],
}

fn units(m2: f64) -> f64 {
    libm::round(m2.clamp(-MOST, MOST) * UNITS)
}

fn product(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) / 2.0
}

impl InnovationCounts {
    /// Adds an innovation, with the agent's last one about the same object, whose place it takes.
    pub(super) fn add(&mut self, own: &Innovation, last: &mut Option<LastInnovation>) {
        self.all += 1.0;
        self.alone += if own.is_alone { 1.0 } else { 0.0 };
        let expected = own.predicted + own.declared;
        let ratio = product(own.difference, own.difference) / expected;
        self.logarithms += libm::round(libm::log(ratio.max(LEAST_RATIO)) * UNITS);
        self.predicted += units(own.predicted);
        self.declared += units(own.declared);
        // What is expected of the prediction is alike in successive innovations.
        if own.predicted_by_positions > MOST_BY_POSITIONS * own.declared || own.bent > MOST_BENT {
            *last = None;
            return;
        }
        let clipped = own.clipped();
        let last = last.replace(LastInnovation { at: own.at, clipped });
        if let Some(last) = last.filter(|last| own.at - last.at <= FORGOTTEN) {
            self.pairs += 1.0;
            self.pair_squares += units(product(clipped, clipped));
            self.products += units(product(clipped, last.clipped));
        }
    }

    /// Lets what was counted fade.
    pub(super) fn scale(&mut self, factor: f64) {
        for sum in [
            &mut self.all,
            &mut self.alone,
            &mut self.logarithms,
            &mut self.predicted,
            &mut self.declared,
            &mut self.pairs,
            &mut self.pair_squares,
            &mut self.products,
        ] {
            *sum *= factor;
        }
    }

    /// Whether more are needed.
    pub(super) fn are_few(&self) -> bool {
        self.pairs < ENOUGH_PAIRS
    }

    fn is_coloured(&self) -> bool {
        if self.pairs < LEAST_PAIRS {
            return false;
        }
        let by_chance = CHANCE_SIGMAS / libm::sqrt(2.0 * self.pairs);
        self.products > (COLOURED + by_chance) * self.pair_squares
    }

    /// Variance along an axis of the part that lasts, m²; 0 where errors are white.
    pub(super) fn lasting_variance(&self) -> f64 {
        if self.is_coloured() { LASTING_SHARE * self.products / (UNITS * self.pairs) } else { 0.0 }
    }

    /// Factor on declared variances; 1 where they are about right. What lasts does not make them smaller.
    pub(super) fn variance_scale(&self) -> f64 {
        if self.all < 2.0 * LEAST_PAIRS || self.declared <= 0.0 {
            return 1.0;
        }
        let [least, most] = SCALE_LIMITS;
        let overall = libm::exp(self.logarithms / (UNITS * self.all) - MEAN_LN);
        let share = self.predicted / self.declared;
        let scale = overall + (overall - 1.0) * share;
        let scale = scale.max(overall * LEAST_OF_OVERALL);
        let scale = scale.clamp(least, most);
        let is_wrong = libm::log(scale).abs() > WRONG_BY;
        // Where most of the difference is expected of the prediction, it says little of the reports.
        let is_known = share <= scale.max(MOST_OF_PREDICTION);
        if !is_wrong || !is_known || (self.is_coloured() && scale < 1.0) { 1.0 } else { scale }
    }

    /// Variance along an axis of what may last for good, m²: an error that stays as it is shows in no innovation of objects that nobody
    /// else detects. So there what is declared and not seen from frame to frame is kept: not in each report, but once.
    pub(super) fn unseen_variance(&self) -> f64 {
        let unseen = 1.0 - self.variance_scale();
        if unseen <= 0.0 {
            return 0.0;
        }
        let declared = self.declared / (UNITS * self.all);
        declared * unseen * (self.alone / self.all)
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        (
            "learning.coloured",
            format!(
                "correlation {COLOURED} and {CHANCE_SIGMAS} sigma of {LEAST_PAIRS} pairs, predicted within {MOST_BY_POSITIONS}, bent up to {MOST_BENT} m/s2, times {LASTING_SHARE}"
            ),
        ),
        (
            "learning.variance_scale",
            format!(
                "beyond e^{WRONG_BY}, within {SCALE_LIMITS:?}, of predictions up to {MOST_OF_PREDICTION}, at least {LEAST_OF_OVERALL}"
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts of innovations of a declared variance of 0.25 m², along x.
    fn counts(differences: impl Iterator<Item = f64>) -> InnovationCounts {
        counts_of(differences, |_| false)
    }

    /// The same, where some are of objects that nobody else detects.
    fn counts_of(differences: impl Iterator<Item = f64>, is_alone: fn(i64) -> bool) -> InnovationCounts {
        let mut counts = InnovationCounts::default();
        let mut last = None;
        for (second, x) in (0..).zip(differences) {
            let at = Timestamp::EPOCH + Span::from_millis(1500 * second);
            let own = Innovation {
                at,
                difference: [x, x],
                predicted: 0.05,
                declared: 0.25,
                by_positions: [x, x],
                predicted_by_positions: 0.05,
                bent: 0.0,
                is_alone: is_alone(second),
            };
            counts.add(&own, &mut last);
        }
        counts
    }

    #[test]
    fn errors_that_last_are_distinguished_from_those_that_change_with_each_frame() {
        let lasting = counts((0..200).map(|_| 0.4)).lasting_variance();
        assert!((lasting - 2.0 * 0.16).abs() < 0.01, "{lasting}");
        let alternating = counts((0..200).map(|k| if k % 2 == 0 { 0.5 } else { -0.5 }));
        assert_eq!(alternating.lasting_variance(), 0.0);
        assert_eq!(counts((0..20).map(|_| 0.4)).lasting_variance(), 0.0, "too few");
    }

    #[test]
    fn a_declared_variance_that_is_about_right_stays_and_a_wrong_one_is_scaled() {
        // Quantiles of an exponential law, with alternating signs.
        let errors = |sigma: f64| {
            counts((0..400_i32).map(move |k| {
                let share = (f64::from(k) + 0.5) / 400.0;
                let size = sigma * libm::sqrt(-libm::log(share));
                if k % 2 == 0 { size } else { -size }
            }))
        };
        let scale = |sigma: f64| errors(sigma).variance_scale();
        assert_eq!(scale(libm::sqrt(0.3)), 1.0);
        assert!((scale(libm::sqrt(1.05)) - 4.0).abs() < 0.2, "{}", scale(libm::sqrt(1.05)));
        assert!((scale(libm::sqrt(0.1)) - 0.2).abs() < 0.05, "{}", scale(libm::sqrt(0.1)));
        // The prediction is too uncertain with the reports.
        assert!(scale(libm::sqrt(0.03)) >= 0.05, "{}", scale(libm::sqrt(0.03)));
    }

    #[test]
    fn what_is_declared_and_not_seen_of_objects_that_nobody_else_detects_may_last_for_good() {
        let small = || (0..400).map(|k| if k % 2 == 0 { 0.1 } else { -0.1 });
        let seen_by_others = counts_of(small(), |_| false);
        let alone = counts_of(small(), |_| true);
        let half = counts_of(small(), |k| k % 2 == 0);
        let scale = alone.variance_scale();
        assert!(scale < 0.2 && scale == seen_by_others.variance_scale());
        assert_eq!(seen_by_others.unseen_variance(), 0.0);
        // Together they are what was declared.
        let unseen = alone.unseen_variance();
        assert!((unseen + 0.25 * scale - 0.25).abs() < 1e-4, "{unseen}");
        assert!((half.unseen_variance() - unseen / 2.0).abs() < 1e-4);
        let large = counts_of((0..400).map(|k| if k % 2 == 0 { 2.0 } else { -2.0 }), |_| true);
        assert!(large.variance_scale() > 1.0 && large.unseen_variance() == 0.0);
    }

    #[test]
    fn where_most_is_expected_of_the_prediction_declared_variances_stay() {
        for size in [0.05, 0.3, 0.7, 0.9] {
            let mut counts = InnovationCounts::default();
            for second in 0..400 {
                let at = Timestamp::EPOCH + Span::from_millis(1000 * second);
                let own = Innovation {
                    at,
                    difference: [size, size],
                    predicted: 1.0,
                    declared: 0.05,
                    by_positions: [size, size],
                    predicted_by_positions: 1.0,
                    bent: 0.0,
                    is_alone: false,
                };
                counts.add(&own, &mut None);
            }
            assert_eq!(counts.variance_scale(), 1.0, "{size}");
        }
    }
}
