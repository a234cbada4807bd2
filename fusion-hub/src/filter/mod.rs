//! UniKF's filter: one object's state and its two steps, predict and update.
//!
//! The paper's state is [x y vx vy w d θ] (eq. 7) with a constant-velocity transition (eq. 8) and a
//! measurement [x y w d θ] (eq. 9). Reports carry no cross terms between position, width, depth and
//! heading, so the 7-state filter falls apart, exactly, into a 4-state one for position and velocity and
//! three scalar ones.

mod kinematic;
mod params;
mod scalar;
mod state;

pub use kinematic::{Kinematic, PositionInnovation};
pub use params::MotionParams;
pub use scalar::{Heading, Size};
pub use state::{Measurement, State};
