//! How tracks are kept.

use crate::association::AssociationConfig;
use crate::track::Rollback;
use crate::values::{Coast, MAX_PARTICLES};
use serde::{Deserialize, Serialize};
use v2x_common::time::Span;

/// How tracks are kept.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackerConfig {
    /// Which detections can be of which tracks.
    pub association: AssociationConfig,
    /// How many hypotheses of association there are.
    pub hypotheses: Hypotheses,
    /// Whether a frame is associated again after a much more accurate one of the same capture time.
    pub reassociate: bool,
    /// What becomes of newer measurements when a late one is applied.
    pub rollback: Rollback,
    /// Measurements this near to a track's own time are taken as simultaneous: ε_s in the paper, zero for exact time.
    pub synchronous: Span,
    /// Whether the class of a track selects its motion parameters; without, every object moves as a car does.
    pub class_motion: bool,
    /// Whether two bodies cannot be at one place: of several boxes there, one is taken, and tracks there are one.
    pub exclusion: bool,
}

/// How many hypotheses of association there are, where it is ambiguous. Several cannot be smoothed together, so that
/// only a single one can have a lag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hypotheses {
    /// One.
    Single {
        /// Fixed lag: objects are published as they were this long ago, by all later evidence (Rauch, Tung & Striebel
        /// 1965). Zero: as they are now.
        lag: Span,
        /// Fixed lag of a second list, beside the first one; `None` without.
        second_lag: Option<Span>,
    },
    /// Several ([`crate::particles`]); their cost is the likelihood, whatever the association's is.
    Particles(ParticleCount),
}

impl Hypotheses {
    /// One, without a lag.
    pub const ONE: Self = Self::with_lag(Span::ZERO);

    /// One, with this lag.
    pub const fn with_lag(lag: Span) -> Self {
        Self::Single { lag, second_lag: None }
    }

    /// The lag; zero where there is none.
    pub const fn lag(self) -> Span {
        match self {
            Self::Single { lag, .. } => lag,
            Self::Particles(_) => Span::ZERO,
        }
    }

    /// The lag of the second list, where there is one.
    pub const fn second_lag(self) -> Option<Span> {
        match self {
            Self::Single { second_lag, .. } => second_lag,
            Self::Particles(_) => None,
        }
    }

    /// The longest lag of a list; zero where there is none.
    pub fn longest_lag(self) -> Span {
        self.second_lag().map_or(self.lag(), |second| second.max(self.lag()))
    }

    /// How many.
    pub const fn count(self) -> u32 {
        match self {
            Self::Single { .. } => 1,
            Self::Particles(count) => count.get(),
        }
    }
}

/// A number of association particles: 2 to [`MAX_PARTICLES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParticleCount(u32);

impl ParticleCount {
    /// `None` where there would be no choice, or more than [`MAX_PARTICLES`].
    pub const fn new(count: u32) -> Option<Self> {
        if count >= 2 && count <= MAX_PARTICLES { Some(Self(count)) } else { None }
    }

    /// The number.
    pub const fn get(self) -> u32 {
        self.0
    }
}

/// For how long evidence and tracks can matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lifetimes {
    /// Δmax: nothing that was captured longer ago is admitted.
    pub delta_max: Span,
    /// How long an object is published without being detected.
    pub coast: Coast,
}
