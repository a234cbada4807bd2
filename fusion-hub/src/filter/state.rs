//! One object's whole state, and one report of it.

use super::{Heading, Kinematic, MotionParams, Size};
use v2x_common::class::Class;
use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::geometry::BevBox;
use v2x_common::time::Timestamp;

/// A detection as the filter sees it: sizes debiased, with variances relative to the true size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// What it looked like.
    pub class: Class,
    /// Position, m.
    pub position: [f64; 2],
    /// Covariance of the position, m².
    pub r: Covariance2,
    /// Width and depth, m.
    pub size: [f64; 2],
    /// Variances of width and depth, relative to the squares of the true ones.
    pub relative_variance: [f64; 2],
    /// Heading, rad.
    pub yaw: f64,
    /// Variance of the heading, rad².
    pub yaw_variance: f64,
    /// Velocity, where it was measured.
    pub velocity: Option<Velocity>,
}

/// The state [x y vx vy w d θ] of one object at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// When it holds.
    pub at: Timestamp,
    /// Position and velocity.
    pub kinematic: Kinematic,
    /// Width, m.
    pub width: Size,
    /// Depth, m.
    pub depth: Size,
    /// Heading, rad.
    pub heading: Heading,
}

impl State {
    /// The state after a first report.
    pub fn born(at: Timestamp, z: &Measurement) -> Self {
        let sigma_velocity = MotionParams::of(z.class).sigma_velocity_mps;
        Self {
            at,
            kinematic: Kinematic::born(z.position, z.r, sigma_velocity, z.velocity.as_ref()),
            width: Size::born(z.size[0], z.relative_variance[0]),
            depth: Size::born(z.size[1], z.relative_variance[1]),
            heading: Heading::born(z.yaw, z.yaw_variance),
        }
    }

    /// The state at another time, later or earlier.
    #[must_use]
    pub fn predicted(&self, to: Timestamp, motion: &MotionParams) -> Self {
        let dt_s = (to - self.at).as_secs_f64();
        let mut state = *self;
        state.at = to;
        if dt_s == 0.0 {
            return state;
        }
        state.kinematic.predict(dt_s, motion.accel_psd);
        state.width.predict(dt_s, motion.size_diffusion);
        state.depth.predict(dt_s, motion.size_diffusion);
        state.heading.predict(dt_s, motion.yaw_diffusion);
        state
    }

    /// Takes in a report made at the state's time.
    pub fn update(&mut self, z: &Measurement) {
        self.kinematic.update_position(z.position, &z.r);
        if let Some(velocity) = &z.velocity {
            self.kinematic.update_velocity(velocity);
        }
        self.width.update(z.size[0], z.relative_variance[0]);
        self.depth.update(z.size[1], z.relative_variance[1]);
        self.heading.update(z.yaw, z.yaw_variance);
    }

    /// The fused box.
    pub fn bev(&self) -> BevBox {
        let [x, y] = self.kinematic.position;
        BevBox { x, y, w: self.width.mean, d: self.depth.mean, yaw: self.heading.mean }
    }
}
