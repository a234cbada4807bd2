//! Errors that all detections of a frame share, because the pose of their sensor is off.
//!
//! They last from frame to frame, so that they do not average out as a sensor's noise does: another agent, whose pose is
//! known better, decides where an object is. What is left of it belongs into the published covariance.

use super::AgentSlot;
use serde::{Deserialize, Serialize};
use v2x_common::sensor::Accuracy;
use v2x_common::time::{Span, Timestamp};

/// Successive frames of one agent err alike for about this long, s.
const ALIKE_FOR_S: f64 = 5.0;
/// An agent with a better pose decides where an object is for so long after its last detection of it, and for so many
/// intervals of its detections.
const DECIDES_FOR: Span = Span::from_millis(1000);
const DECIDES_INTERVALS: f64 = 3.0;

/// Upper limits of declared accuracies: no more is corrected in a frame, and no pose is worth less.
pub const MOST_ACCURACY: Accuracy = Accuracy { position_m: 10.0, yaw_rad: 0.1, clock_s: 1.0 };

/// Variances of what is unknown of a sensor's pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseErrors {
    /// Of its position along each axis, m².
    pub position: f64,
    /// Of its heading, rad².
    pub yaw: f64,
}

impl PoseErrors {
    /// The pose is known.
    pub const NONE: Self = Self { position: 0.0, yaw: 0.0 };

    /// As an agent declares it, within [`MOST_ACCURACY`].
    pub fn declared(accuracy: &Accuracy) -> Self {
        let position_m = accuracy.position_m.min(MOST_ACCURACY.position_m);
        let yaw_rad = accuracy.yaw_rad.min(MOST_ACCURACY.yaw_rad);
        Self { position: position_m * position_m, yaw: yaw_rad * yaw_rad }
    }

    /// Variance of a position along an axis (m²) of a pose that is displaced by this variance in a time (s): of errors that are
    /// alike for a while as those of a first-order Gauss-Markov process are.
    pub fn by_displacement(variance: f64, after_s: f64) -> f64 {
        variance / (2.0 * -libm::expm1(-after_s / ALIKE_FOR_S))
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn are_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Mean variance (m²) along an axis of the position of an object at a distance (m): a turned pose moves it across.
    pub fn variance_at(&self, range_m: f64) -> f64 {
        self.position + self.yaw * range_m * range_m / 2.0
    }
}

/// The error that an estimate shares with the agent that decides where the object is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SharedError {
    /// Variance along an axis, m².
    pub variance: f64,
    agent: AgentSlot,
    /// Its last detection.
    at: Timestamp,
    /// Mean time between its frames, s.
    interval_s: f64,
}

/// A detection whose position errs with its agent's pose.
#[derive(Clone, Copy, Debug)]
pub struct PoseDetection {
    /// The agent.
    pub agent: AgentSlot,
    /// Capture time.
    pub at: Timestamp,
    /// Variance of the shared error along an axis, m².
    pub variance: f64,
    /// Mean time between frames of the agent, s.
    pub interval_s: f64,
}

/// What must be added before an update, m² along each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Widened {
    /// To the estimate.
    pub estimate: f64,
    /// To the measurement.
    pub measurement: f64,
}

impl Widened {
    /// Nothing.
    pub const NONE: Self = Self { estimate: 0.0, measurement: 0.0 };
}

impl SharedError {
    /// After a first detection.
    #[inline(always)]
    pub fn initial(detection: &PoseDetection) -> Self {
        let PoseDetection { agent, at, variance, interval_s } = *detection;
        Self { variance, agent, at, interval_s }
    }

    /// Variance (m²) along an axis of what the estimate and a detection of an agent do not share.
    #[inline(always)]
    pub fn apart(&self, agent: AgentSlot, variance: f64) -> f64 {
        if self.agent == agent { 0.0 } else { self.variance + variance }
    }

    /// Takes in a detection, with what is to be added before its update.
    ///
    /// The agent with the best pose decides. All that others report in the time over which the estimate averages, or in which
    /// their errors are alike, is worth one detection with this error. `averaged` is how many detections like this one the
    /// estimate is worth.
    #[inline(always)]
    pub fn take_in(&mut self, detection: &PoseDetection, averaged: impl FnOnce() -> f64) -> Widened {
        let PoseDetection { agent, variance, .. } = *detection;
        if agent == self.agent || (variance == 0.0 && self.variance == 0.0) {
            *self = Self::initial(detection);
            return Widened::NONE;
        }
        self.take_in_of_another(detection, averaged)
    }

    fn take_in_of_another(&mut self, detection: &PoseDetection, averaged: impl FnOnce() -> f64) -> Widened {
        let PoseDetection { agent, at, variance, interval_s } = *detection;
        let is_better = variance < self.variance;
        if is_better || at > self.decides_until() {
            let estimate = self.apart(agent, variance);
            *self = Self::initial(detection);
            return Widened { estimate, measurement: 0.0 };
        }
        let most = (2.0 * ALIKE_FOR_S / interval_s).max(1.0);
        Widened {
            estimate: 0.0,
            measurement: variance + averaged().clamp(1.0, most) * (variance - self.variance),
        }
    }

    fn decides_until(&self) -> Timestamp {
        self.at + DECIDES_FOR.max(Span::from_secs_f64(DECIDES_INTERVALS * self.interval_s))
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("pose_errors.alike_for_s", ALIKE_FOR_S.to_string()),
        ("pose_errors.decides_for", format!("{DECIDES_FOR:?}, at least {DECIDES_INTERVALS} intervals")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::AgentNames;
    use v2x_common::id::AgentId;

    fn detections() -> [PoseDetection; 2] {
        let mut names = AgentNames::default();
        ["exact", "rough"].map(|name| PoseDetection {
            agent: names.slot_for(AgentId::new(name).unwrap()),
            at: Timestamp::EPOCH,
            variance: if name == "exact" { 0.0 } else { 1.0 },
            interval_s: 0.1,
        })
    }

    fn later(detection: PoseDetection, ms: i64) -> PoseDetection {
        PoseDetection { at: Timestamp::EPOCH + Span::from_millis(ms), ..detection }
    }

    #[test]
    fn one_agent_alone_is_believed_as_it_reports() {
        let [_, rough] = detections();
        let mut shared = SharedError::initial(&rough);
        assert_eq!(shared.take_in(&later(rough, 100), || 5.0), Widened::NONE);
        assert_eq!((shared.variance, shared.apart(rough.agent, 1.0)), (1.0, 0.0));
    }

    #[test]
    fn a_better_pose_takes_over_and_a_worse_one_then_counts_for_little() {
        let [exact, rough] = detections();
        let mut shared = SharedError::initial(&rough);
        assert_eq!(shared.take_in(&later(exact, 50), || 5.0), Widened { estimate: 1.0, measurement: 0.0 });
        assert_eq!(shared.variance, 0.0);
        let Widened { estimate, measurement } = shared.take_in(&later(rough, 100), || 5.0);
        assert!(estimate == 0.0 && measurement == 6.0 && shared.variance == 0.0);
    }

    #[test]
    fn a_worse_pose_decides_again_once_the_better_one_sees_the_object_no_more() {
        let [exact, rough] = detections();
        let mut shared = SharedError::initial(&exact);
        assert_eq!(shared.take_in(&later(rough, 1100), || 5.0), Widened { estimate: 1.0, measurement: 0.0 });
        assert_eq!(shared.variance, 1.0);
        // Three frames of a slow sensor.
        let mut slow = SharedError::initial(&PoseDetection { interval_s: 1.0, ..exact });
        assert!(slow.take_in(&later(rough, 1100), || 5.0).measurement > 0.0 && slow.variance == 0.0);
    }

    #[test]
    fn a_turned_pose_moves_what_is_far_away() {
        let errors = PoseErrors { position: 0.04, yaw: 0.0001 };
        assert_eq!(errors.variance_at(0.0), 0.04);
        assert!((errors.variance_at(100.0) - 0.54).abs() < 1e-12);
    }
}
