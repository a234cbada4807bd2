//! The error of an agent's own pose: one for all that a frame reports.
//!
//! A constant bias, and a Gauss-Markov process, which can be computed for any frame without those before it.

use crate::random::{GaussMarkov, Purpose, keyed_rng, standard_normal};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::AgentId;

/// The error of an agent's pose. It is the same in the frame's sensor pose, in the agent's report of itself and in all
/// detections of the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseError {
    /// σ of the random part east and north, each, m.
    pub position_m: f64,
    /// σ of the random part of the heading, rad.
    pub yaw_rad: f64,
    /// τ of the random part, s; with 0 the errors of frames are independent.
    pub correlation_s: f64,
    /// The constant part: east and north in the map frame (m), and of the heading (rad).
    pub bias: Pose,
}

/// The frame for which an error is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameKey<'a> {
    /// The run's seed.
    pub(crate) seed: u64,
    /// The agent that captures it.
    pub(crate) agent: &'a AgentId,
    /// Its number.
    pub(crate) sequence: u64,
}

/// The true pose of an agent, and its own estimate of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EstimatedPose {
    /// The true pose.
    pub(crate) truth: Pose,
    /// The pose that the agent reports, and by which it places its detections on the map.
    pub(crate) estimate: Pose,
}

impl PoseError {
    /// The estimate of an agent at `pose` in a frame, of which there are `rate_hz` in a second.
    pub(crate) fn estimate(&self, pose: &Pose, frame: &FrameKey<'_>, rate_hz: f64) -> Pose {
        let steps = GaussMarkov::<3> { correlation_frames: self.correlation_s * rate_hz };
        let draw = |knot| {
            let mut rng = keyed_rng(frame.seed, Some(frame.agent), knot, Purpose::PoseError);
            [0; 3].map(|_| standard_normal(&mut rng))
        };
        let [x, y, yaw] = steps.at(frame.sequence, &draw);
        Pose {
            x: pose.x + self.bias.x + self.position_m * x,
            y: pose.y + self.bias.y + self.position_m * y,
            yaw: wrap_angle(pose.yaw + self.bias.yaw + self.yaw_rad * yaw),
        }
    }
}

impl EstimatedPose {
    /// A box that was measured relative to the sensor, placed on the map by the estimate instead of the true pose.
    pub(crate) fn place(&self, measured: &BevBox) -> BevBox {
        let turn = wrap_angle(self.estimate.yaw - self.truth.yaw);
        let from_sensor = Pose { x: self.estimate.x, y: self.estimate.y, yaw: turn };
        let (x, y) = from_sensor.offset(measured.x - self.truth.x, measured.y - self.truth.y);
        BevBox { x, y, yaw: wrap_angle(measured.yaw + turn), ..*measured }
    }
}

#[cfg(test)]
mod tests;
