//! How an agent's headings err: they may be turned round, or off by a constant.

use super::Measurement;
use serde::{Deserialize, Serialize};
use v2x_common::geometry::wrap_angle;

/// ln of 49 to 1.
const LN_49: f64 = 3.891_820_298_110_627;

/// How long errors of headings last, s (.35 to .79 are left after a second on recorded data).
const LASTS_S: f64 = 2.0;

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
        /// Variance of the part of the errors that lasts for seconds, rad²: it does not average out over frames.
        lasting: f64,
    },
}

impl HeadingLaw {
    /// Of an agent that nothing is known of: one heading in fifty is turned round.
    pub const UNKNOWN: Self = Self::Mixture { front_odds_ln: LN_49, offset: 0.0, lasting: 0.0 };

    /// A heading (rad) as it was reported, before it was corrected.
    pub fn reported(&self, yaw: f64) -> f64 {
        match *self {
            Self::Mixture { offset, .. } => yaw + offset,
            Self::AsReported => yaw,
        }
    }

    /// Variance (rad²) by which a frame's headings count for less, with this time between frames, s: of errors that last for a
    /// time τ a mean over much more than τ is as uncertain as that of white ones of 2τ/Δt times their variance (power spectral
    /// density at 0 of a first-order Gauss-Markov process: Gelb 1974, section 2.4).
    #[inline]
    pub fn by_lasting(&self, interval_s: f64) -> f64 {
        match *self {
            Self::Mixture { lasting, .. } if lasting > 0.0 => {
                lasting * (2.0 * LASTS_S / interval_s - 1.0).max(0.0)
            }
            _ => 0.0,
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
