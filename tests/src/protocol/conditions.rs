//! What agents can see: everything, as in the paper, or what sensors see.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use v2x_common::sensor::FieldOfView;

/// Conditions of an evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Conditions {
    /// As in the paper: every agent reports every object once, and nothing else
    #[default]
    Paper,
    /// Every agent sees its own surroundings, misses one object in ten, and reports things that are not there
    Sensors,
}

/// Beyond every object of every scene, m.
const UNLIMITED_M: f64 = 1000.0;
/// Both agents' range under [`Conditions::Sensors`], m: about what a lidar detector is rated for on nuScenes
/// (50 m for vehicles).
const RANGE_M: f64 = 50.0;
/// How far they are apart, m: so half of what each sees the other one does not.
const APART_M: f64 = 40.0;

impl Conditions {
    /// Probability that an agent reports an object in its view.
    pub const fn detection_probability(self) -> f64 {
        match self {
            Self::Paper => 1.0,
            Self::Sensors => 0.9,
        }
    }

    /// Expected false reports of an agent in a frame.
    pub const fn clutter_per_frame(self) -> f64 {
        match self {
            Self::Paper => 0.0,
            Self::Sensors => 0.5,
        }
    }

    /// How far agents see, m.
    pub const fn range_m(self) -> f64 {
        match self {
            Self::Paper => UNLIMITED_M,
            Self::Sensors => RANGE_M,
        }
    }

    /// How far agent 2 is from agent 1, m, all the time; `None` where it is drawn for every frame anew.
    pub const fn apart_m(self) -> Option<f64> {
        match self {
            Self::Paper => None,
            Self::Sensors => Some(APART_M),
        }
    }

    /// What agents see.
    pub const fn field_of_view(self) -> FieldOfView {
        FieldOfView::omnidirectional(0.0, self.range_m())
    }

    /// False reports of an agent per frame and m².
    pub const fn clutter_per_m2(self) -> f64 {
        self.clutter_per_frame() / (PI * self.range_m() * self.range_m())
    }
}
