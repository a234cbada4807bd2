//! With what probability a sensor detects an object: by range, and after a detection or a miss of the same object.

use serde::{Deserialize, Serialize};

/// Width of a bin of ranges, m.
pub const RANGE_BIN_M: f64 = 10.0;
/// Number of bins of ranges; the last one holds everything beyond.
pub const RANGE_BINS: usize = 16;

/// Detection probabilities of one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectionProfile {
    by_range: [f64; RANGE_BINS],
    /// Correlation of one frame with the next about one object, 0 to 1: misses come in runs, because occlusion lasts.
    correlation: f64,
    /// Whether it is the same at every range.
    is_uniform: bool,
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
        Self { by_range: [probability; RANGE_BINS], correlation: 0.0, is_uniform: true }
    }

    /// By range, with the correlation of successive frames.
    pub const fn new(by_range: [f64; RANGE_BINS], correlation: f64) -> Self {
        Self { by_range, correlation, is_uniform: false }
    }

    /// With other probabilities.
    #[must_use]
    pub fn map(&self, of: impl Fn(f64) -> f64) -> Self {
        Self { by_range: self.by_range.map(of), ..*self }
    }

    /// Whether the range matters: it takes a square root to know.
    #[inline]
    pub const fn depends_on_range(&self) -> bool {
        !self.is_uniform
    }

    /// Of an object at this range (m), whatever was before.
    #[inline]
    pub fn probability(&self, range_m: f64) -> f64 {
        if self.is_uniform { self.by_range[0] } else { self.by_range[range_bin(range_m)] }
    }

    /// Of an object at this range (m) that the sensor's last frame held or missed; the first time, of any.
    #[inline]
    pub fn given(&self, range_m: f64, last: Option<bool>) -> f64 {
        let probability = self.probability(range_m);
        match last {
            Some(true) => probability + self.correlation * (1.0 - probability),
            Some(false) => probability * (1.0 - self.correlation),
            None => probability,
        }
    }

    /// What a detection is worth more after a detection than at any time, and less after a miss: a factor.
    #[inline]
    pub fn detected_again(&self, range_m: f64, last: Option<bool>) -> f64 {
        if self.correlation == 0.0 {
            return 1.0;
        }
        self.given(range_m, last) / self.probability(range_m)
    }

    /// Correlation of successive frames.
    pub const fn correlation(&self) -> f64 {
        self.correlation
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn successive_frames_agree_on_average_with_the_probability_at_a_range() {
        let mut by_range = [0.9; RANGE_BINS];
        by_range[3] = 0.6;
        let profile = DetectionProfile::new(by_range, 0.7);
        for (range_m, p) in [(35.0, 0.6), (5.0, 0.9), (1e6, 0.9)] {
            let [hit, miss] = [true, false].map(|last| profile.given(range_m, Some(last)));
            assert!((p * hit + (1.0 - p) * miss - p).abs() < 1e-12, "stationary at {range_m} m");
            assert!(miss < p && p < hit && profile.given(range_m, None) == p);
        }
    }

    #[test]
    fn without_correlation_the_past_does_not_matter() {
        let profile = DetectionProfile::uniform(0.8);
        assert_eq!(profile.given(50.0, Some(false)), 0.8);
        assert_eq!(profile.detected_again(50.0, Some(true)), 1.0);
    }
}
