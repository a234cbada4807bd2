//! How an agent's scores are calibrated: how often something with a score is real.
//!
//! What one agent reports another one reports, too, as often as it detects objects there, if it is real; and hardly ever if it
//! is not. The share of the expected detections is the probability of being real. Only an agent that stands elsewhere is asked:
//! from one place the same things look like objects.
//!
//! Where nobody stands elsewhere, the agent's own next frame tells: it holds a real object again as often as the agent detects one that
//! it has just detected, and a false one with [`FALSE_AGAIN`] of that. This needs no second viewpoint, and it does not
//! suppose what a score means: the bands are as wide on any scale, but hold other detections.
//!
//! Before either is known, scores are read by one law for all; the scores of the best detections shift it, as a detector whose best
//! ones score low is seldom one that detects nothing.

use crate::values::{SCORE_BANDS, ScoreBand, ScoreModel, logit};
use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// Slope of the odds of a real object over the odds that a score states, and the score that is no evidence, until others
/// confirm or do not.
const SLOPE: f64 = 2.0;
const NEUTRAL_LN: f64 = -0.847_297_860_387_203_7;
/// A detector whose best detections score lower in the mean, as ln of their odds, means more by a score than others do.
const BEST_LN: f64 = 0.4;
/// The law of all has the weight of so many expected detections in each band.
const PRIOR: f64 = 30.0;
/// Successive frames are independent evidence after so long, s; further apart they are not compared.
const INDEPENDENT_AFTER_S: f64 = 0.5;
const FOLLOWED_AFTER_AT_MOST: Span = Span::from_millis(2500);
/// Scores whose calibration differs by less than this, ln, over all bands that are known say nothing.
const UNINFORMATIVE_LN: f64 = 0.7;
/// What is false is detected again with this share of the probability of a real object: .57-.69 of four detectors with the lowest scores
/// of real traffic.
const FALSE_AGAIN: f64 = 0.6;
/// The law of all has the weight of so many expected detections against the agent's own next frames, which tell no false object that
/// persists: with them alone the probability of being real is at most this.
const PRIOR_OF_OWN: f64 = 10.0;
const MOST_BY_OWN: f64 = 0.9;
/// Probabilities of being real are at least and at most this.
const REAL: [f64; 2] = [0.02, 0.95];
/// Frames further apart are not compared, and sensors nearer to each other.
const APART_AT_MOST: Span = Span::from_millis(300);
pub(super) const ELSEWHERE_M: f64 = 5.0;
/// Scores that differ by less are all the same.
const SCORE_SPREAD: f64 = 0.01;
/// Unit of sums: whole numbers add up to the same in any order.
const UNITS: f64 = 4096.0;

/// Counts of one agent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct ScoreCounts {
    /// Detections of others that are expected if all is real, and those that there were, by band.
    expected: [f64; SCORE_BANDS],
    detected: [f64; SCORE_BANDS],
    /// The same of the agent's own next frames, beyond what is expected if nothing is real.
    own_expected: [f64; SCORE_BANDS],
    own_detected: [f64; SCORE_BANDS],
    /// Sum of ln of the odds of the best score of each frame, and their number.
    best: (f64, f64),
    /// The least and the greatest score.
    range: (f64, f64),
}

impl Default for ScoreCounts {
    fn default() -> Self {
        Self {
            expected: [0.0; SCORE_BANDS],
            detected: [0.0; SCORE_BANDS],
            own_expected: [0.0; SCORE_BANDS],
            own_detected: [0.0; SCORE_BANDS],
            best: (0.0, 0.0),
            range: (f64::INFINITY, f64::NEG_INFINITY),
        }
    }
}

/// A detection that another agent may confirm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Scored {
    pub(super) band: ScoreBand,
    pub(super) at: Timestamp,
    /// Position of the sensor, m.
    pub(super) sensor: [f64; 2],
}

/// A frame of another agent that covers the place of a detection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Witness {
    pub(super) at: Timestamp,
    /// Position of its sensor, m.
    pub(super) position: [f64; 2],
    /// Probability that it detects an object there.
    pub(super) probability: f64,
    pub(super) is_detected: bool,
}

impl Witness {
    /// Whether it says something about a detection.
    pub(super) fn is_of(&self, scored: &Scored) -> bool {
        let [[x, y], [sx, sy]] = [self.position, scored.sensor];
        let apart = libm::hypot(x - sx, y - sy);
        self.at - scored.at <= APART_AT_MOST && apart >= ELSEWHERE_M
    }
}

impl ScoreCounts {
    /// Notes the least and the greatest score of a frame with detections.
    pub(super) fn add_frame(&mut self, [least, greatest]: [f64; 2]) {
        if greatest >= least {
            self.range = (self.range.0.min(least), self.range.1.max(greatest));
            self.best.0 += libm::round(logit(greatest) * UNITS);
            self.best.1 += 1.0;
        }
    }

    /// Counts what a witness says of a detection with a score of this band.
    pub(super) fn add(&mut self, band: ScoreBand, witness: &Witness) {
        self.expected[band.index()] += libm::round(witness.probability * UNITS);
        self.detected[band.index()] += if witness.is_detected { UNITS } else { 0.0 };
    }

    /// Counts what the agent's own next frame says of a detection: whether it holds it again, which it does with this probability if
    /// it is real.
    pub(super) fn add_followed(
        &mut self,
        scored: &Scored,
        at: Timestamp,
        probability: f64,
        is_detected: bool,
    ) {
        let apart = at - scored.at;
        if apart <= Span::ZERO || apart > FOLLOWED_AFTER_AT_MOST {
            return;
        }
        let weight = UNITS * (apart.as_secs_f64() / INDEPENDENT_AFTER_S).min(1.0);
        let by_chance = FALSE_AGAIN * probability;
        let detected = if is_detected { 1.0 } else { 0.0 };
        self.own_expected[scored.band.index()] += libm::round(weight * (probability - by_chance));
        self.own_detected[scored.band.index()] += libm::round(weight * (detected - by_chance));
    }

    /// Lets what was counted fade.
    pub(super) fn scale(&mut self, factor: f64) {
        let Self { expected, detected, own_expected, own_detected, .. } = self;
        for sums in [expected, detected, own_expected, own_detected] {
            sums.iter_mut().for_each(|sum| *sum *= factor);
        }
        self.best.0 *= factor;
        self.best.1 *= factor;
    }

    fn differ(&self) -> bool {
        self.range.1 - self.range.0 > SCORE_SPREAD
    }

    /// ln of the odds of the score that is no evidence, before anybody confirms.
    fn neutral_ln(&self) -> f64 {
        if self.best.1 < 1.0 {
            return NEUTRAL_LN;
        }
        NEUTRAL_LN + (self.best.0 / (self.best.1 * UNITS) - BEST_LN).min(0.0)
    }

    /// How scores are read.
    pub(super) fn model(&self) -> ScoreModel {
        if !self.differ() {
            return ScoreModel::Ignored;
        }
        let neutral = self.neutral_ln();
        let centres = ScoreBand::centres();
        let by_law: [f64; SCORE_BANDS] =
            centres.map(|centre| 1.0 / (1.0 + libm::exp(-SLOPE * (centre - neutral))));
        let share = |detected: f64, expected: f64, (before, weight): (f64, f64)| {
            ((detected / UNITS).max(0.0) + weight * before) / (expected / UNITS + weight)
        };
        let by_band: [f64; SCORE_BANDS] = std::array::from_fn(|band| {
            let mut by_own =
                share(self.own_detected[band], self.own_expected[band], (by_law[band], PRIOR_OF_OWN));
            if self.own_expected[band] >= UNITS {
                by_own = by_own.min(MOST_BY_OWN);
            }
            share(self.detected[band], self.expected[band], (by_own, PRIOR))
        });
        let known = self.known();
        let counts = known.map(|known| known + PRIOR);
        #[expect(clippy::cast_possible_truncation, reason = "single precision is intended")]
        let ln_odds = std::array::from_fn(|band| {
            // What nobody confirmed or disputed is read by the law itself: its tails are no probabilities of a count.
            if known[band] < 1.0 {
                (SLOPE * (centres[band] - neutral)) as f32
            } else {
                ln_odds_of(by_band[band]) as f32
            }
        });
        let ln_odds = increasing(ln_odds, counts);
        if self.are_uninformative(&ln_odds) {
            ScoreModel::Ignored
        } else {
            ScoreModel::Calibrated { ln_odds }
        }
    }

    /// What is known of each band, in expected detections.
    fn known(&self) -> [f64; SCORE_BANDS] {
        std::array::from_fn(|band| (self.expected[band] + self.own_expected[band]) / UNITS)
    }

    /// Whether what is well known of several bands is all the same.
    fn are_uninformative(&self, ln_odds: &[f32; SCORE_BANDS]) -> bool {
        let known = self.known();
        let well_known =
            || ln_odds.iter().zip(known).filter(|(_, known)| *known > PRIOR).map(|(ln, _)| f64::from(*ln));
        let (least, most) =
            (well_known().fold(f64::INFINITY, f64::min), well_known().fold(f64::NEG_INFINITY, f64::max));
        well_known().count() > 1 && most - least < UNINFORMATIVE_LN
    }
}

fn ln_odds_of(probability: f64) -> f64 {
    let [least, most] = REAL;
    let limited = probability.clamp(least, most);
    libm::log(limited / (1.0 - limited))
}

/// Where a higher score would say less, the weighted mean of both: neighbours are pooled until none is left (Ayer et al. 1955).
fn increasing(values: [f32; SCORE_BANDS], weights: [f64; SCORE_BANDS]) -> [f32; SCORE_BANDS] {
    let mut pools: [(f64, f64, usize); SCORE_BANDS] = [(0.0, 0.0, 0); SCORE_BANDS];
    let mut n = 0;
    for (value, weight) in values.into_iter().zip(weights) {
        pools[n] = (f64::from(value), weight, 1);
        n += 1;
        while n > 1 && pools[n - 2].0 > pools[n - 1].0 {
            let [(a, wa, na), (b, wb, nb)] = [pools[n - 2], pools[n - 1]];
            pools[n - 2] = ((a * wa + b * wb) / (wa + wb), wa + wb, na + nb);
            n -= 1;
        }
    }
    let mut pooled = [0.0; SCORE_BANDS];
    let mut places = pooled.iter_mut();
    for (value, _, count) in &pools[..n] {
        #[expect(clippy::cast_possible_truncation, reason = "single precision is intended")]
        places.by_ref().take(*count).for_each(|place| *place = *value as f32);
    }
    pooled
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![(
        "learning.score",
        format!(
            "slope {SLOPE} about ln odds {NEUTRAL_LN} where the best have {BEST_LN}; weight {PRIOR}, real {REAL:?}; own frames {INDEPENDENT_AFTER_S} s apart, weight {PRIOR_OF_OWN}, false again {FALSE_AGAIN}, at most {MOST_BY_OWN}; all the same within {UNINFORMATIVE_LN}"
        ),
    )]
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: Timestamp = Timestamp::EPOCH;

    fn witness(is_detected: bool) -> Witness {
        Witness { at: AT, position: [50.0, 0.0], probability: 0.8, is_detected }
    }

    fn with_best(greatest: f64) -> ScoreCounts {
        let mut counts = ScoreCounts::default();
        (0..100).for_each(|_| counts.add_frame([0.02, greatest]));
        counts
    }

    #[test]
    fn equal_scores_are_no_evidence() {
        let mut counts = ScoreCounts::default();
        counts.add_frame([1.0, 1.0]);
        counts.add_frame([f64::INFINITY, f64::NEG_INFINITY]);
        assert_eq!(counts.model(), ScoreModel::Ignored);
    }

    #[test]
    fn what_others_confirm_at_a_low_score_is_real_and_what_they_never_see_is_not() {
        let mut counts = with_best(0.9);
        let before = counts.model();
        assert!((before.ln_odds(0.3)).abs() < 0.01);
        for k in 0..1000 {
            // A detector whose 0.15 is right in four of five cases, which the other detects by 0.8.
            counts.add(ScoreBand::of(0.15), &witness(k % 100 < 64));
            counts.add(ScoreBand::of(0.6), &witness(k % 10 < 8));
        }
        let after = counts.model();
        assert!(before.ln_odds(0.15) < -1.5 && after.ln_odds(0.15) > 0.8, "{after:?}");
        let mut ghosts = with_best(0.9);
        (0..1000).for_each(|k| ghosts.add(ScoreBand::of(0.6), &witness(k % 100 < 8)));
        assert!(ghosts.model().ln_odds(0.6) < -1.0, "{:?}", ghosts.model());
    }

    /// Own next frames 0.1 s apart, of a detector that detects real objects again in nine of ten cases.
    fn follow(counts: &mut ScoreCounts, score: f64, again_in_100: i64) {
        for k in 0..2000 {
            let at = AT + Span::from_millis(100 * k);
            let scored = Scored { band: ScoreBand::of(score), at, sensor: [0.0, 0.0] };
            counts.add_followed(&scored, at + Span::from_millis(100), 0.9, k % 100 < again_in_100);
        }
    }

    #[test]
    fn without_another_viewpoint_the_own_next_frames_calibrate_scores_whatever_their_scale() {
        // Of the lower scores the half is false, and six tenths of that is detected again; of the higher ones all is real.
        // Scores in the middle of bands.
        for [low, high] in [[0.245, 0.755], [0.033, 0.407], [0.755, 0.966]] {
            let mut counts = with_best(high);
            follow(&mut counts, low, 72);
            follow(&mut counts, high, 90);
            let model = counts.model();
            assert!(model.ln_odds(low).abs() < 0.6, "{low}: {model:?}");
            assert!(model.ln_odds(high) > 1.5, "{high}: {model:?}");
        }
    }

    #[test]
    fn scores_that_differ_and_say_nothing_are_no_evidence() {
        let mut counts = with_best(0.9);
        for score in [0.1, 0.25, 0.4, 0.6, 0.75, 0.9] {
            follow(&mut counts, score, 80);
        }
        assert_eq!(counts.model(), ScoreModel::Ignored);
    }

    #[test]
    fn a_frame_long_after_or_at_the_same_time_follows_none() {
        let scored = Scored { band: ScoreBand::of(0.5), at: AT, sensor: [0.0, 0.0] };
        let mut counts = with_best(0.9);
        let before = counts;
        counts.add_followed(&scored, AT, 0.9, true);
        counts.add_followed(&scored, AT + Span::from_millis(4000), 0.9, false);
        assert_eq!(counts, before);
    }

    #[test]
    fn a_detector_whose_best_detections_score_low_is_read_by_them() {
        let [usual, low] = [0.9, 0.2].map(|best| with_best(best).model());
        assert!(usual.ln_odds(0.2) < -1.0 && low.ln_odds(0.2) > 2.0, "{usual:?} {low:?}");
        assert_eq!(with_best(0.7).model(), usual);
    }

    #[test]
    fn a_higher_score_never_says_less() {
        let mut counts = with_best(0.9);
        (0..500).for_each(|_| counts.add(ScoreBand::of(0.2), &witness(true)));
        (0..500).for_each(|_| counts.add(ScoreBand::of(0.6), &witness(false)));
        let model = counts.model();
        let ln_odds: Vec<f64> = (1..100).map(|score| model.ln_odds(f64::from(score) / 100.0)).collect();
        assert!(ln_odds.is_sorted(), "{ln_odds:?}");
    }

    #[test]
    fn only_a_frame_soon_after_from_elsewhere_is_a_witness() {
        let scored = Scored { band: ScoreBand::of(0.5), at: AT, sensor: [0.0, 0.0] };
        let at =
            |ms: i64, x: f64| Witness { at: AT + Span::from_millis(ms), position: [x, 0.0], ..witness(true) };
        assert!(at(100, 50.0).is_of(&scored));
        assert!(!at(400, 50.0).is_of(&scored) && !at(100, 2.0).is_of(&scored));
    }
}
