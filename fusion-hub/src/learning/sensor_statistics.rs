//! What the frames of an agent show without tracks: its range and its rate.

use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// Ranges of detections are counted in steps of this, m.
const STEP_M: f64 = 5.0;
const STEPS: usize = 64;
/// Share of the detections that are within the range that is taken as the sensor's.
const WITHIN: f64 = 0.97;
/// A view reaches this much further than that.
const VIEW_FACTOR: f64 = 1.5;
/// Detections from which on a range is known.
const LEAST_DETECTIONS: f64 = 5.0;
/// Frames further apart than this are not successive.
const LONGEST_INTERVAL: Span = Span::from_millis(5000);

/// Statistics of one agent's frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SensorStatistics {
    #[serde(with = "crate::values::arrays")]
    ranges: [f64; STEPS],
    intervals: Intervals,
    newest: Option<Timestamp>,
}

/// Times between successive frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Intervals {
    sum_s: f64,
    count: f64,
}

impl Default for SensorStatistics {
    fn default() -> Self {
        Self { ranges: [0.0; STEPS], intervals: Intervals::default(), newest: None }
    }
}

impl SensorStatistics {
    /// Counts a detection at a range (m), where that is known.
    pub(super) fn add_detection(&mut self, range_m: Option<f64>) {
        if let Some(range_m) = range_m {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "clamped to the steps"
            )]
            let step = (range_m / STEP_M).clamp(0.0, (STEPS - 1) as f64) as usize;
            self.ranges[step] += 1.0;
        }
    }

    /// Counts a frame. Frames come in order of capture.
    pub(super) fn add_frame(&mut self, captured_at: Timestamp) {
        if let Some(newest) = self.newest
            && captured_at - newest <= LONGEST_INTERVAL
        {
            self.intervals.sum_s += (captured_at - newest).as_secs_f64();
            self.intervals.count += 1.0;
        }
        self.newest = self.newest.max(Some(captured_at));
    }

    /// Lets what was counted fade.
    pub(super) fn scale(&mut self, factor: f64) {
        self.ranges.iter_mut().for_each(|count| *count *= factor);
        self.intervals.sum_s *= factor;
        self.intervals.count *= factor;
    }

    /// The range that nearly all detections are within, m.
    pub(super) fn reach_m(&self) -> Option<f64> {
        let total: f64 = self.ranges.iter().sum();
        if total < LEAST_DETECTIONS {
            return None;
        }
        let mut within = 0.0;
        let step = self.ranges.iter().position(|count| {
            within += count;
            within >= WITHIN * total
        })?;
        #[expect(clippy::cast_precision_loss, reason = "at most 64")]
        let edge = (step + 1) as f64 * STEP_M;
        Some(edge)
    }

    /// How far the sensor's view reaches, m.
    pub(super) fn view_m(&self) -> Option<f64> {
        self.reach_m().map(|reach_m| VIEW_FACTOR * reach_m)
    }

    /// Mean time between frames, s.
    pub(super) fn interval_s(&self) -> Option<f64> {
        (self.intervals.count > 0.0).then(|| self.intervals.sum_s / self.intervals.count)
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![("learning.view", format!("{VIEW_FACTOR} times the range of {WITHIN} of the detections"))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_view_reaches_beyond_nearly_all_detections_and_ignores_an_outlier() {
        let mut statistics = SensorStatistics::default();
        assert_eq!(statistics.view_m(), None);
        for k in 0..100 {
            statistics.add_detection(Some(f64::from(k) * 0.5));
        }
        statistics.add_detection(Some(300.0));
        assert_eq!(statistics.reach_m(), Some(50.0));
        assert_eq!(statistics.view_m(), Some(75.0));
    }

    #[test]
    fn the_interval_of_frames_ignores_gaps() {
        let mut statistics = SensorStatistics::default();
        for ms in [0, 500, 1000, 60_000, 60_500] {
            statistics.add_frame(Timestamp::EPOCH + Span::from_millis(ms));
        }
        assert_eq!(statistics.interval_s(), Some(0.5));
    }
}
