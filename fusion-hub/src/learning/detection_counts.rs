//! How often an agent detected the objects that it could have detected.

use crate::values::{CLASS_GROUPS, DetectionProfile, Groups, RANGE_BINS, with_factor};
use serde::{Deserialize, Serialize};
use v2x_common::class::ClassGroup;

/// Weight of what is assumed in advance of a sensor that nothing is known of, in frames of an object.
const PRIOR_FRAMES: f64 = 50.0;
/// Weight of the sensor's probability at all ranges for that at one range, and of that of all classes for that of one group.
const RANGE_FRAMES: f64 = 100.0;
const GROUP_FRAMES: f64 = 30.0;
/// Ranges and groups are fitted by turns, so often: where groups stand at other ranges, neither alone says what the other does.
const FITTED: usize = 2;
/// Probabilities are kept from being certain.
const LEAST_PROBABILITY: f64 = 0.02;
/// Beyond the range from which the sensor reports at all, it is unlikely to detect anything.
const BEYOND_RANGE: f64 = 0.3;
/// A declared probability is given up where what is seen is off by so many standard deviations, and by this much more.
const CONTRADICTION_SIGMAS: f64 = 4.0;
const CONTRADICTION_MARGIN: f64 = 0.05;
/// And where at least so many frames of objects were seen.
const CONTRADICTION_FRAMES: f64 = 50.0;
/// Of one group of classes more: they may be of a single object that is hidden for a while.
const GROUP_CONTRADICTION_FRAMES: f64 = 300.0;
/// A sensor that begins to fail shows in the frames of the last seconds: its probability of late counts where it is below that
/// of before by so much, and by more than chance, to which runs of misses add.
const DECLINE: f64 = 0.2;
const DECLINE_SIGMAS: f64 = 8.0;

/// Detections among opportunities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Share {
    pub(super) detected: f64,
    pub(super) all: f64,
}

impl Share {
    fn add(&mut self, is_detected: bool) {
        self.detected += f64::from(u8::from(is_detected));
        self.all += 1.0;
    }

    fn scale(&mut self, factor: f64) {
        self.detected *= factor;
        self.all *= factor;
    }

    /// Whether it contradicts a declared probability, where it is of so many frames at least.
    fn contradicts(&self, declared: f64, least_frames: f64) -> bool {
        if self.all < least_frames {
            return false;
        }
        let sigma = libm::sqrt(declared * (1.0 - declared) / self.all);
        (self.detected / self.all - declared).abs() > CONTRADICTION_SIGMAS * sigma + CONTRADICTION_MARGIN
    }

    /// With so many of its detections.
    fn times(self, left: f64) -> Self {
        Self { detected: self.detected * left, ..self }
    }

    /// Posterior mean of the probability, with a prior mean of this weight.
    fn mean(&self, prior: f64, weight: f64) -> f64 {
        (self.detected + weight * prior) / (self.all + weight)
    }
}

/// Counts of one agent. They are whole numbers between two decays, so that their order does not matter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct DetectionCounts {
    by_group: [[Share; RANGE_BINS]; CLASS_GROUPS],
    /// Of those frames that followed a miss and a detection of the same object.
    after: [[[Share; RANGE_BINS]; CLASS_GROUPS]; 2],
    /// At all ranges, of the last seconds.
    recent: Share,
}

/// What is known of detection probabilities in advance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ProfilePrior {
    /// Probability.
    pub(crate) probability: f64,
    /// Correlation of successive frames.
    pub(crate) correlation: f64,
}

/// What could hold a detection of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Opportunity {
    /// The object's range.
    pub(super) range_bin: usize,
    /// What the agent's frame before held; `None` for the first one.
    pub(super) before: Option<bool>,
}

fn total<'a>(shares: impl Iterator<Item = &'a Share>) -> Share {
    shares.fold(Share::default(), |sum, share| Share {
        detected: sum.detected + share.detected,
        all: sum.all + share.all,
    })
}

fn odds(probability: f64) -> f64 {
    let probability = probability.clamp(LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY);
    probability / (1.0 - probability)
}

impl DetectionCounts {
    /// Counts a frame that could hold a detection of an object of this group.
    pub(super) fn add(&mut self, group: ClassGroup, opportunity: Opportunity, is_detected: bool) {
        self.by_group[group as usize][opportunity.range_bin].add(is_detected);
        self.recent.add(is_detected);
        if let Some(before) = opportunity.before {
            self.after[usize::from(before)][group as usize][opportunity.range_bin].add(is_detected);
        }
    }

    /// Lets what was counted fade, and that of the last seconds by a factor of its own.
    pub(super) fn scale(&mut self, factor: f64, recent_factor: f64) {
        self.recent.scale(recent_factor);
        let after = self.after.iter_mut().flatten();
        self.by_group.iter_mut().chain(after).flatten().for_each(|share| share.scale(factor));
    }

    pub(super) fn total(&self) -> Share {
        total(self.by_group.iter().flatten())
    }

    /// Of each group of classes, at all ranges.
    pub(super) fn of_groups(&self) -> impl Iterator<Item = (ClassGroup, Share)> {
        ClassGroup::ALL.into_iter().map(|group| (group, total(self.by_group[group as usize].iter())))
    }

    /// The share of what it detected before that it still detects; 1 unless it has clearly become worse.
    fn left_of_late(&self) -> f64 {
        let Share { detected, all } = self.total();
        if self.recent.all < CONTRADICTION_FRAMES {
            return 1.0;
        }
        let (before, now) = (detected / all, self.recent.detected / self.recent.all);
        let sigma = libm::sqrt(before * (1.0 - before) / self.recent.all);
        if before - now > DECLINE + DECLINE_SIGMAS * sigma { now / before } else { 1.0 }
    }

    /// The probabilities, where reports come from up to `reach_bin`.
    pub(super) fn profile(&self, prior: ProfilePrior, reach_bin: usize) -> DetectionProfile {
        let ProfilePrior { probability, correlation } = prior;
        let overall = self.total().mean(probability, PRIOR_FRAMES);
        let left = self.left_of_late();
        let by_range = std::array::from_fn(|bin| {
            let expected = if bin > reach_bin { overall.min(BEYOND_RANGE) } else { overall };
            let mean = total(self.by_group.iter().map(|shares| &shares[bin])).mean(expected, RANGE_FRAMES);
            (mean * left).clamp(LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY)
        });
        let is_one = self.of_groups().filter(|(_, share)| share.all > 0.0).nth(1).is_none();
        let mut profile = DetectionProfile::new(by_range, 0.0);
        if !is_one {
            profile = profile.with_groups(self.groups(overall * left, left, reach_bin));
        }
        profile
            .with_correlation(self.correlation(&profile.map(|probability| probability / left), correlation))
    }

    /// Correlation of successive frames about one object: how much more often it is detected after a detection, and less often
    /// after a miss, than objects of its group are at its range. (Objects that differ would else look like misses in runs.)
    fn correlation(&self, profile: &DetectionProfile, prior: f64) -> f64 {
        // Of a detection x after another one, x - p is c (1 - p) on average, and p - x after a miss is c p.
        let mut more = PRIOR_FRAMES * prior;
        let mut at_most = PRIOR_FRAMES;
        for (after, sign) in self.after.iter().zip([-1.0, 1.0]) {
            for (shares, group) in after.iter().zip(ClassGroup::ALL) {
                for (Share { detected, all }, bin) in
                    shares.iter().zip(0..).filter(|(share, _)| share.all > 0.0)
                {
                    let probability = profile.in_bin(bin, group);
                    more += sign * (detected - all * probability);
                    at_most += all * if sign > 0.0 { 1.0 - probability } else { probability };
                }
            }
        }
        (more / at_most).clamp(0.0, 1.0 - LEAST_PROBABILITY)
    }

    /// Odds by range times factors of groups, which agree with what was seen at each range and of each group (iterative
    /// proportional fitting: Bishop, Fienberg & Holland 1975, section 3.5), beginning with a probability of all. `left` is the
    /// share of what was seen that still holds.
    fn groups(&self, of_all: f64, left: f64, to_bin: usize) -> Groups {
        let mut fitted = Groups { by_range: [of_all; RANGE_BINS], factors: [1.0; CLASS_GROUPS], to_bin };
        for _ in 0..FITTED {
            for (shares, place) in self.by_group.iter().zip(0..) {
                let of_group = total(shares.iter()).times(left);
                let mean = |factor: f64| {
                    let at = |(bin, share): (usize, &Share)| share.all * fitted.probability(bin, factor);
                    shares.iter().enumerate().map(at).sum::<f64>() / of_group.all
                };
                if of_group.all > 0.0 {
                    let factor = fitted.factors[place];
                    let seen = of_group.mean(mean(1.0), GROUP_FRAMES);
                    fitted.factors[place] = factor * odds(seen) / odds(mean(factor));
                }
            }
            for bin in 0..RANGE_BINS {
                let shares = || self.by_group.iter().map(|shares| &shares[bin]);
                let at_range = total(shares()).times(left);
                let mean = |probability: f64| {
                    let of = |(share, factor): (&Share, &f64)| share.all * with_factor(probability, *factor);
                    shares().zip(&fitted.factors).map(of).sum::<f64>() / at_range.all
                };
                if at_range.all > 0.0 {
                    let probability = fitted.by_range[bin];
                    let seen = at_range.mean(mean(of_all), RANGE_FRAMES);
                    let odds = odds(probability) * odds(seen) / odds(mean(probability));
                    fitted.by_range[bin] = odds / (1.0 + odds);
                }
            }
        }
        fitted
    }

    /// Whether what was seen contradicts a declared probability: of all, or of one group of classes.
    pub(super) fn contradict(&self, declared: f64) -> bool {
        let seen = if self.left_of_late() < 1.0 { self.recent } else { self.total() };
        seen.contradicts(declared, CONTRADICTION_FRAMES)
            || self.of_groups().any(|(_, share)| share.contradicts(declared, GROUP_CONTRADICTION_FRAMES))
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        (
            "learning.prior_frames",
            format!(
                "{PRIOR_FRAMES}, {RANGE_FRAMES} at a range, {GROUP_FRAMES} of a group of classes, fitted {FITTED} times"
            ),
        ),
        ("learning.least_probability", LEAST_PROBABILITY.to_string()),
        ("learning.beyond_range", BEYOND_RANGE.to_string()),
        (
            "learning.contradiction",
            format!(
                "{CONTRADICTION_SIGMAS} sigma and {CONTRADICTION_MARGIN} after {CONTRADICTION_FRAMES} frames, {GROUP_CONTRADICTION_FRAMES} of a group of classes; of late {DECLINE_SIGMAS} and {DECLINE}"
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAR: ClassGroup = ClassGroup::FourWheeled;
    const PERSON: ClassGroup = ClassGroup::Pedestrian;

    fn at(range_bin: usize, before: Option<bool>) -> Opportunity {
        Opportunity { range_bin, before }
    }

    const UNKNOWN: ProfilePrior = ProfilePrior { probability: 0.7, correlation: 0.5 };

    /// Counts of an agent that detects an object in runs of ten frames, and misses it in runs of ten.
    fn in_runs(n: usize) -> DetectionCounts {
        let mut counts = DetectionCounts::default();
        let mut before = None;
        for frame in 0..n {
            let is_detected = frame / 10 % 2 == 0;
            counts.add(CAR, at(3, before), is_detected);
            before = Some(is_detected);
        }
        counts
    }

    #[test]
    fn nothing_seen_is_the_prior_and_much_seen_is_what_was_seen() {
        let profile = DetectionCounts::default().profile(UNKNOWN, 15);
        assert!(
            (profile.probability(35.0, CAR) - 0.7).abs() < 1e-12
                && (profile.correlation() - 0.5).abs() < 1e-12
        );
        let profile = in_runs(20_000).profile(UNKNOWN, 15);
        assert!((profile.probability(35.0, CAR) - 0.5).abs() < 0.01, "{profile:?}");
        assert!((profile.correlation() - 0.8).abs() < 0.01, "{profile:?}");
    }

    #[test]
    fn each_range_has_its_own_probability_once_there_is_evidence() {
        let mut counts = DetectionCounts::default();
        for _ in 0..2000 {
            counts.add(CAR, at(1, None), true);
            counts.add(CAR, at(6, None), false);
        }
        let profile = counts.profile(UNKNOWN, 15);
        assert!(profile.probability(15.0, CAR) > 0.95 && profile.probability(65.0, CAR) < 0.05);
        assert!((profile.probability(35.0, CAR) - 0.5).abs() < 0.05, "without evidence as at all ranges");
    }

    #[test]
    fn a_sensor_that_goes_blind_after_long_is_found_out_in_seconds_and_one_that_misses_a_run_is_not() {
        let long = || {
            let mut counts = DetectionCounts::default();
            for frame in 0..3000 {
                counts.add(CAR, at(2, Some(true)), frame % 20 != 0);
                counts.scale(0.9999, 0.99);
            }
            counts
        };
        let prior = ProfilePrior { probability: 0.95, correlation: 0.0 };
        let mut blind = long();
        assert!(!blind.contradict(0.95) && blind.profile(prior, 15).probability(25.0, CAR) > 0.9);
        (0..300).for_each(|_| {
            blind.add(CAR, at(2, Some(false)), false);
            blind.scale(0.9999, 0.99);
        });
        assert!(blind.contradict(0.95) && blind.profile(prior, 15).probability(25.0, CAR) < 0.2, "{blind:?}");
        let mut occluded = long();
        (0..15).for_each(|_| occluded.add(CAR, at(2, Some(false)), false));
        assert!(!occluded.contradict(0.95), "{occluded:?}");
        (0..500).for_each(|_| {
            blind.add(CAR, at(2, Some(true)), true);
            blind.scale(0.9999, 0.99);
        });
        assert!(blind.profile(prior, 15).probability(25.0, CAR) > 0.8, "and it recovers: {blind:?}");
    }

    #[test]
    fn a_blind_sensor_contradicts_what_it_declares_and_a_good_one_does_not() {
        let mut blind = DetectionCounts::default();
        (0..60).for_each(|_| blind.add(CAR, at(2, Some(false)), false));
        assert!(blind.contradict(0.999) && blind.contradict(0.5));
        let mut good = DetectionCounts::default();
        (0..1000).for_each(|frame| good.add(CAR, at(2, Some(true)), frame % 10 != 0));
        assert!(!good.contradict(0.9) && !good.contradict(0.93) && good.contradict(0.7));
    }

    #[test]
    fn a_group_of_classes_that_is_seen_less_often_has_its_own_probability_at_its_own_ranges() {
        let mut counts = DetectionCounts::default();
        for frame in 0..4000 {
            counts.add(CAR, at(frame % 8, None), frame % 20 != 0);
            // People stand near.
            counts.add(PERSON, at(frame % 2, None), frame % 5 < 2);
        }
        let profile = counts.profile(UNKNOWN, 15);
        for (range_m, group, expected) in [(75.0, CAR, 0.95), (5.0, PERSON, 0.4), (15.0, PERSON, 0.4)] {
            let found = profile.probability(range_m, group);
            assert!((found - expected).abs() < 0.05, "{group:?} at {range_m} m: {found}");
        }
        let near = profile.probability(5.0, CAR);
        assert!(near > 0.92 && profile.of_all(5.0) < 0.5, "cars near are not taken for people: {near}");
        assert!(counts.contradict(0.95), "what is declared of all does not hold of people");
    }

    #[test]
    fn objects_that_differ_are_no_misses_in_runs() {
        let mut counts = DetectionCounts::default();
        let mut random = 1_u32;
        let mut draw = |share: f64| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random >> 8) / f64::from(1_u32 << 24) < share
        };
        let mut before = [None; 2];
        for _ in 0..10_000 {
            for (place, (group, share)) in [(CAR, 0.95), (PERSON, 0.4)].into_iter().enumerate() {
                let is_detected = draw(share);
                counts.add(group, at(2, before[place]), is_detected);
                before[place] = Some(is_detected);
            }
        }
        let profile = counts.profile(UNKNOWN, 15);
        assert!(profile.correlation() < 0.03, "{}", profile.correlation());
    }

    #[test]
    fn where_only_one_group_is_seen_it_is_as_all_and_the_others_are_taken_for_alike() {
        let mut counts = DetectionCounts::default();
        (0..1000).for_each(|frame| counts.add(CAR, at(2, None), frame % 10 != 0));
        let profile = counts.profile(UNKNOWN, 15);
        let found = ClassGroup::ALL.map(|group| profile.probability(25.0, group));
        assert_eq!(found, [found[0]; CLASS_GROUPS]);
        assert!(!counts.contradict(0.9));
    }
}
