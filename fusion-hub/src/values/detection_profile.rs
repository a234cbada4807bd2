//! With what probability a sensor detects an object: by range, by what the object is, and after a detection or a miss of the
//! same object.

use serde::{Deserialize, Serialize};
use v2x_common::class::ClassGroup;

/// Width of a bin of ranges, m.
pub const RANGE_BIN_M: f64 = 10.0;
/// Number of bins of ranges; the last one holds everything beyond.
pub const RANGE_BINS: usize = 16;
/// Number of groups of classes.
pub const CLASS_GROUPS: usize = ClassGroup::ALL.len();

/// Detection probabilities of one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectionProfile {
    by_range: [f64; RANGE_BINS],
    groups: Groups,
    /// Correlation of one frame with the next about one object, 0 to 1: misses come in runs, because occlusion lasts.
    correlation: f64,
    /// Whether it is the same at every range.
    is_uniform: bool,
}

/// What is known of groups of classes: the odds of a detection are those at the range times a factor of the group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Groups {
    /// Probability by range of a group whose factor is 1.
    pub by_range: [f64; RANGE_BINS],
    /// Factor of each group; of 1 where nothing is known of it: then it is as all.
    pub factors: [f64; CLASS_GROUPS],
    /// Up to which bin of ranges they hold: beyond it, nobody knows.
    pub to_bin: usize,
}

impl Groups {
    /// All alike.
    pub const ALIKE: Self = Self { by_range: [0.0; RANGE_BINS], factors: [1.0; CLASS_GROUPS], to_bin: 0 };

    /// Probability at a range of a group with this factor.
    #[inline]
    pub fn probability(&self, bin: usize, factor: f64) -> f64 {
        with_factor(self.by_range[bin], factor)
    }
}

/// A probability whose odds are a factor times those of another.
#[inline]
pub(crate) fn with_factor(probability: f64, factor: f64) -> f64 {
    let odds = factor * probability;
    odds / (odds + 1.0 - probability)
}

/// The place of a range (m) among the bins.
pub fn range_bin(range_m: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the bins")]
    let bin = (range_m / RANGE_BIN_M).clamp(0.0, (RANGE_BINS - 1) as f64) as usize;
    bin
}

impl DetectionProfile {
    /// The same at every range and in every frame.
    pub const fn uniform(probability: f64) -> Self {
        Self {
            by_range: [probability; RANGE_BINS],
            groups: Groups::ALIKE,
            correlation: 0.0,
            is_uniform: true,
        }
    }

    /// By range, the same of all classes, with the correlation of successive frames.
    pub const fn new(by_range: [f64; RANGE_BINS], correlation: f64) -> Self {
        Self { by_range, groups: Groups::ALIKE, correlation, is_uniform: false }
    }

    /// With what is known of groups of classes.
    #[must_use]
    pub const fn with_groups(self, groups: Groups) -> Self {
        Self { groups, ..self }
    }

    /// With this correlation of successive frames.
    #[must_use]
    pub const fn with_correlation(self, correlation: f64) -> Self {
        Self { correlation, ..self }
    }

    /// With other probabilities.
    #[must_use]
    pub fn map(&self, of: impl Fn(f64) -> f64) -> Self {
        let groups = Groups { by_range: self.groups.by_range.map(&of), ..self.groups };
        Self { by_range: self.by_range.map(of), groups, ..*self }
    }

    /// Whether the range matters: it takes a square root to know.
    #[inline]
    pub const fn depends_on_range(&self) -> bool {
        !self.is_uniform
    }

    /// Of an object at this range (m), whatever it is.
    #[inline]
    pub fn of_all(&self, range_m: f64) -> f64 {
        if self.is_uniform { self.by_range[0] } else { self.by_range[range_bin(range_m)] }
    }

    /// Of an object of this group at this range (m), whatever was before.
    #[inline]
    pub fn probability(&self, range_m: f64, group: ClassGroup) -> f64 {
        if self.groups.factors[group as usize] == 1.0 {
            return self.of_all(range_m);
        }
        self.in_bin(range_bin(range_m), group)
    }

    /// The same in a bin of ranges.
    #[inline]
    pub fn in_bin(&self, bin: usize, group: ClassGroup) -> f64 {
        let factor = self.groups.factors[group as usize];
        let is_as_all = factor == 1.0 || bin > self.groups.to_bin;
        if is_as_all { self.by_range[bin] } else { self.groups.probability(bin, factor) }
    }

    /// Of an object that the sensor's last frame held or missed; the first time, of any. `probability` is that of
    /// [`Self::probability`].
    #[inline]
    pub fn given(&self, probability: f64, last: Option<bool>) -> f64 {
        match last {
            Some(true) => probability + self.correlation * (1.0 - probability),
            Some(false) => probability * (1.0 - self.correlation),
            None => probability,
        }
    }

    /// What a detection is worth more after a detection than at any time, and less after a miss: a factor.
    #[inline]
    pub fn detected_again(&self, probability: f64, last: Option<bool>) -> f64 {
        if self.correlation == 0.0 {
            return 1.0;
        }
        self.given(probability, last) / probability
    }

    /// Correlation of successive frames.
    pub const fn correlation(&self) -> f64 {
        self.correlation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAR: ClassGroup = ClassGroup::FourWheeled;

    #[test]
    fn successive_frames_agree_on_average_with_the_probability_at_a_range() {
        let mut by_range = [0.9; RANGE_BINS];
        by_range[3] = 0.6;
        let profile = DetectionProfile::new(by_range, 0.7);
        for (range_m, p) in [(35.0, 0.6), (5.0, 0.9), (1e6, 0.9)] {
            assert_eq!(profile.probability(range_m, CAR), p);
            let [hit, miss] = [true, false].map(|last| profile.given(p, Some(last)));
            assert!((p * hit + (1.0 - p) * miss - p).abs() < 1e-12, "stationary at {range_m} m");
            assert!(miss < p && p < hit && profile.given(p, None) == p);
        }
    }

    #[test]
    fn without_correlation_the_past_does_not_matter() {
        let profile = DetectionProfile::uniform(0.8);
        assert_eq!(profile.given(0.8, Some(false)), 0.8);
        assert_eq!(profile.detected_again(0.8, Some(true)), 1.0);
    }

    #[test]
    fn a_group_has_its_odds_as_far_as_detections_come_from_and_stays_a_probability() {
        let mut factors = [1.0; CLASS_GROUPS];
        factors[ClassGroup::Pedestrian as usize] = 0.25;
        let groups = Groups { by_range: [0.8; RANGE_BINS], factors, to_bin: 4 };
        let profile = DetectionProfile::new([0.8; RANGE_BINS], 0.3).with_groups(groups);
        assert_eq!(profile.probability(25.0, CAR), 0.8);
        assert!((profile.probability(25.0, ClassGroup::Pedestrian) - 0.5).abs() < 1e-12);
        assert_eq!(profile.probability(55.0, ClassGroup::Pedestrian), 0.8, "beyond");
        for factor in [1e-9, 1e9] {
            let groups = Groups { factors: [factor; CLASS_GROUPS], ..groups };
            let extreme = profile.with_groups(groups).probability(25.0, CAR);
            assert!((0.0..=1.0).contains(&extreme), "{extreme}");
        }
    }
}
