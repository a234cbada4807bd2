//! How often an agent detected the objects that it could have detected.

use crate::values::{DetectionProfile, RANGE_BINS};
use serde::{Deserialize, Serialize};

/// Weight of what is assumed in advance of a sensor that nothing is known of, in frames of an object.
const PRIOR_FRAMES: f64 = 50.0;
/// Weight of the sensor's probability at all ranges for that at one range.
const RANGE_FRAMES: f64 = 100.0;
/// Probabilities are kept from being certain.
const LEAST_PROBABILITY: f64 = 0.02;
/// Beyond the range from which the sensor reports at all, it is unlikely to detect anything.
const BEYOND_RANGE: f64 = 0.3;
/// A declared probability is given up where what is seen is off by so many standard deviations, and by this much more.
const CONTRADICTION_SIGMAS: f64 = 4.0;
const CONTRADICTION_MARGIN: f64 = 0.05;
/// And where at least so many frames of objects were seen.
const CONTRADICTION_FRAMES: f64 = 50.0;
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

    /// Posterior mean of the probability, with a prior mean of this weight.
    fn mean(&self, prior: f64, weight: f64) -> f64 {
        (self.detected + weight * prior) / (self.all + weight)
    }
}

/// Counts of one agent. They are whole numbers between two decays, so that their order does not matter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct DetectionCounts {
    by_range: [Share; RANGE_BINS],
    after_detection: Share,
    after_miss: Share,
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

impl DetectionCounts {
    /// Counts a frame that could hold a detection of an object in this range bin, after the agent's frame before.
    pub(super) fn add(&mut self, range_bin: usize, before: Option<bool>, is_detected: bool) {
        self.by_range[range_bin].add(is_detected);
        self.recent.add(is_detected);
        match before {
            Some(true) => self.after_detection.add(is_detected),
            Some(false) => self.after_miss.add(is_detected),
            None => {}
        }
    }

    /// Lets what was counted fade, and that of the last seconds by a factor of its own.
    pub(super) fn scale(&mut self, factor: f64, recent_factor: f64) {
        self.recent.scale(recent_factor);
        self.by_range.iter_mut().for_each(|share| share.scale(factor));
        self.after_detection.scale(factor);
        self.after_miss.scale(factor);
    }

    pub(super) fn total(&self) -> Share {
        let sum = |of: fn(&Share) -> f64| self.by_range.iter().map(of).sum();
        Share { detected: sum(|share| share.detected), all: sum(|share| share.all) }
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
            let mean = self.by_range[bin].mean(expected, RANGE_FRAMES);
            (mean * left).clamp(LEAST_PROBABILITY, 1.0 - LEAST_PROBABILITY)
        });
        let again = self.after_detection.mean(probability + correlation * (1.0 - probability), PRIOR_FRAMES);
        let anew = self.after_miss.mean(probability * (1.0 - correlation), PRIOR_FRAMES);
        DetectionProfile::new(by_range, (again - anew).clamp(0.0, 1.0 - LEAST_PROBABILITY))
    }

    /// Whether what was seen contradicts a declared probability.
    pub(super) fn contradict(&self, declared: f64) -> bool {
        let seen = if self.left_of_late() < 1.0 { self.recent } else { self.total() };
        let Share { detected, all } = seen;
        if all < CONTRADICTION_FRAMES {
            return false;
        }
        let sigma = libm::sqrt(declared * (1.0 - declared) / all);
        (detected / all - declared).abs() > CONTRADICTION_SIGMAS * sigma + CONTRADICTION_MARGIN
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("learning.prior_frames", format!("{PRIOR_FRAMES}, {RANGE_FRAMES} at a range")),
        ("learning.least_probability", LEAST_PROBABILITY.to_string()),
        ("learning.beyond_range", BEYOND_RANGE.to_string()),
        (
            "learning.contradiction",
            format!(
                "{CONTRADICTION_SIGMAS} sigma and {CONTRADICTION_MARGIN} after {CONTRADICTION_FRAMES} frames; of late {DECLINE_SIGMAS} and {DECLINE}"
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNKNOWN: ProfilePrior = ProfilePrior { probability: 0.7, correlation: 0.5 };

    /// Counts of an agent that detects an object in runs of ten frames, and misses it in runs of ten.
    fn in_runs(n: usize) -> DetectionCounts {
        let mut counts = DetectionCounts::default();
        let mut before = None;
        for frame in 0..n {
            let is_detected = frame / 10 % 2 == 0;
            counts.add(3, before, is_detected);
            before = Some(is_detected);
        }
        counts
    }

    #[test]
    fn nothing_seen_is_the_prior_and_much_seen_is_what_was_seen() {
        let profile = DetectionCounts::default().profile(UNKNOWN, 15);
        assert!(
            (profile.probability(35.0) - 0.7).abs() < 1e-12 && (profile.correlation() - 0.5).abs() < 1e-12
        );
        let profile = in_runs(20_000).profile(UNKNOWN, 15);
        assert!((profile.probability(35.0) - 0.5).abs() < 0.01, "{profile:?}");
        assert!((profile.correlation() - 0.8).abs() < 0.01, "{profile:?}");
    }

    #[test]
    fn each_range_has_its_own_probability_once_there_is_evidence() {
        let mut counts = DetectionCounts::default();
        for _ in 0..2000 {
            counts.add(1, None, true);
            counts.add(6, None, false);
        }
        let profile = counts.profile(UNKNOWN, 15);
        assert!(profile.probability(15.0) > 0.95 && profile.probability(65.0) < 0.05);
        assert!((profile.probability(35.0) - 0.5).abs() < 0.05, "without evidence as at all ranges");
    }

    #[test]
    fn a_sensor_that_goes_blind_after_long_is_found_out_in_seconds_and_one_that_misses_a_run_is_not() {
        let long = || {
            let mut counts = DetectionCounts::default();
            for frame in 0..3000 {
                counts.add(2, Some(true), frame % 20 != 0);
                counts.scale(0.9999, 0.99);
            }
            counts
        };
        let prior = ProfilePrior { probability: 0.95, correlation: 0.0 };
        let mut blind = long();
        assert!(!blind.contradict(0.95) && blind.profile(prior, 15).probability(25.0) > 0.9);
        (0..300).for_each(|_| {
            blind.add(2, Some(false), false);
            blind.scale(0.9999, 0.99);
        });
        assert!(blind.contradict(0.95) && blind.profile(prior, 15).probability(25.0) < 0.2, "{blind:?}");
        let mut occluded = long();
        (0..15).for_each(|_| occluded.add(2, Some(false), false));
        assert!(!occluded.contradict(0.95), "{occluded:?}");
        (0..500).for_each(|_| {
            blind.add(2, Some(true), true);
            blind.scale(0.9999, 0.99);
        });
        assert!(blind.profile(prior, 15).probability(25.0) > 0.8, "and it recovers: {blind:?}");
    }

    #[test]
    fn a_blind_sensor_contradicts_what_it_declares_and_a_good_one_does_not() {
        let mut blind = DetectionCounts::default();
        (0..60).for_each(|_| blind.add(2, Some(false), false));
        assert!(blind.contradict(0.999) && blind.contradict(0.5));
        let mut good = DetectionCounts::default();
        (0..1000).for_each(|frame| good.add(2, Some(true), frame % 10 != 0));
        assert!(!good.contradict(0.9) && !good.contradict(0.93) && good.contradict(0.7));
    }
}
