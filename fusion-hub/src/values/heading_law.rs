//! How an agent's headings err: they may be turned round, or off by a constant.

use super::Measurement;
use serde::{Deserialize, Serialize};
use v2x_common::geometry::wrap_angle;

/// ln of 49 to 1.
const LN_49: f64 = 3.891_820_298_110_627;

/// An agent's headings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum HeadingLaw {
    /// They err by a normal distribution, as declared.
    #[default]
    AsReported,
    /// They may also be turned by half a turn, or by a quarter where width and depth are exchanged.
    Mixture {
        /// ln of the odds that a reported front is the front.
        front_odds_ln: f64,
        /// Constant error, rad.
        offset: f64,
    },
}

impl HeadingLaw {
    /// Of an agent that nothing is known of: one heading in fifty is turned round.
    pub const UNKNOWN: Self = Self::Mixture { front_odds_ln: LN_49, offset: 0.0 };

    /// A heading (rad) as it was reported, before it was corrected.
    pub fn reported(&self, yaw: f64) -> f64 {
        match *self {
            Self::Mixture { offset, .. } => yaw + offset,
            Self::AsReported => yaw,
        }
    }

    /// Takes the constant error from a measurement.
    pub fn correct(&self, z: &mut Measurement) {
        if let Self::Mixture { offset, .. } = *self
            && offset != 0.0
        {
            z.yaw = wrap_angle(z.yaw - offset);
        }
    }
}
