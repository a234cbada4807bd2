//! The error of an agent's own pose: one for all that a frame reports.
//!
//! A constant bias, and a Gauss-Markov process (Ornstein-Uhlenbeck: stationary, autocorrelation e^(-|t|/τ)) that can
//! be computed for any frame without those before it. Knots stand 14 τ apart, where the correlation that is neglected
//! is e^-14 < 1e-6; they are independent draws. Between two knots the process is filled in by halves, each middle
//! drawn given its two neighbours by the exact conditional law (the process is Markov). So a frame costs log2(14 τ · rate)
//! draws, and not the thousands of a moving average with the same precision; its variance is short of 1 by less
//! than e^-28.

use crate::random::{Purpose, keyed_rng, standard_normal};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::AgentId;

/// Between two knots, in correlation times.
const KNOT_SPACING: f64 = 14.0;

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
        let steps = GaussMarkov { correlation_frames: self.correlation_s * rate_hz };
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

/// Three independent Gauss-Markov processes of variance 1, over frame numbers.
struct GaussMarkov {
    correlation_frames: f64,
}

impl GaussMarkov {
    /// The processes at frame `n`; `draw` gives the independent standard normal draws of a frame number.
    fn at(&self, n: u64, draw: &impl Fn(u64) -> [f64; 3]) -> [f64; 3] {
        let mut length = self.knot_spacing();
        let mut left = n - n % length;
        if left == n {
            return draw(n);
        }
        // Beyond the last frame number there are no frames: any draw serves as the value there.
        let (mut before, mut after) = (draw(left), draw(left.wrapping_add(length)));
        loop {
            length /= 2;
            let middle = left + length;
            let here = self.between(&before, &after, length, &draw(middle));
            if middle == n {
                return here;
            }
            if n < middle {
                after = here;
            } else {
                (left, before) = (middle, here);
            }
        }
    }

    /// Frames between two knots, a power of two so that halving ends at each frame.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positive, and casts saturate"
    )]
    fn knot_spacing(&self) -> u64 {
        let frames = libm::ceil(KNOT_SPACING * self.correlation_frames) as u64;
        frames.clamp(1, 1 << 48).next_power_of_two()
    }

    /// The middle between two values that are `half` frames away on either side: with ρ = e^(-half/τ) its mean is
    /// (before + after) ρ / (1 + ρ²) and its variance (1 - ρ²) / (1 + ρ²).
    fn between(&self, before: &[f64; 3], after: &[f64; 3], half: u64, draw: &[f64; 3]) -> [f64; 3] {
        let exponent = -(half as f64) / self.correlation_frames;
        let rho = libm::exp(exponent);
        // 1 - ρ² without cancellation where ρ is almost 1.
        let lost = -libm::expm1(2.0 * exponent);
        let (weight, sigma) = (rho / (1.0 + rho * rho), libm::sqrt(lost / (1.0 + rho * rho)));
        std::array::from_fn(|axis| weight * (before[axis] + after[axis]) + sigma * draw[axis])
    }
}

#[cfg(test)]
mod tests;
