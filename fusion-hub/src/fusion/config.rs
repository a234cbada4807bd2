//! How a hub fuses.

use super::window::WindowConfig;
use crate::association::{AssociationConfig, AssociationCost, ClassRule};
use crate::registration::Registration;
use crate::track::Rollback;
use crate::tracker::{Hypotheses, TrackerConfig};
use crate::values::ClassLaw;
use serde::{Deserialize, Serialize};
use v2x_common::time::Span;

/// Gate of the likelihood, which weighs by itself what lies within: the gate only saves time. 0.999996 of true pairs
/// are within it; a hub of ten agents makes 10 000 pairs a second, and each one outside initiates a second track.
const WIDE_GATE: f64 = 25.0;

/// How a hub fuses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Fusion {
    /// It keeps tracks.
    Tracking(TrackingConfig),
    /// It applies a rule to the newest frames of the agents, without memory.
    Window(WindowConfig),
}

impl Default for Fusion {
    fn default() -> Self {
        Self::Tracking(TrackingConfig::default())
    }
}

/// How objects are taken to move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionModel {
    /// Constant velocity: the paper's UniKF.
    Cv,
    /// Four interacting models: parked, stopped, smooth, manoeuvring.
    #[default]
    Imm,
}

/// What the first detection of an object is worth, by an agent that describes no sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Births {
    /// It is published once there is evidence that it exists: a second detection, mostly.
    #[default]
    Cautious,
    /// It is published at once: for sensors that report nothing false.
    AtOnce,
}

/// How objects are tracked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackingConfig {
    /// How objects move.
    pub motion: MotionModel,
    /// How tracks are kept.
    pub tracker: TrackerConfig,
    /// Whether two tracks that frames show to be of one object are merged.
    pub resolve_duplicates: bool,
    /// Whether the sizes of all objects of a class are a prior of each; without, its own detections alone count, every
    /// logarithm of a size being equally likely at first.
    pub class_size_priors: bool,
    /// What is done about clock and pose errors of agents ([`crate::registration`]).
    pub registration: Registration,
    /// What the first detection of an agent that describes no sensor is worth.
    pub births: Births,
    /// Whether it is learnt what each agent's sensor is like: what an agent declares is then held against what is seen, and
    /// frames of agents that declare nothing are evidence, too.
    pub learning: bool,
    /// Least probability of existence of a published object.
    pub publish_existence: f64,
}

impl Default for TrackingConfig {
    fn default() -> Self {
        Self {
            motion: MotionModel::default(),
            tracker: TrackerConfig {
                association: AssociationConfig {
                    cost: AssociationCost::Likelihood,
                    gate: WIDE_GATE,
                    turned_headings: true,
                    classes: ClassRule::Evidence,
                    class_law: ClassLaw::UNKNOWN,
                },
                hypotheses: Hypotheses::ONE,
                reassociate: true,
                rollback: Rollback::Replay,
                synchronous: Span::ZERO,
                class_motion: true,
                exclusion: true,
            },
            resolve_duplicates: true,

            class_size_priors: true,
            registration: Registration::default(),
            births: Births::Cautious,
            learning: true,
            publish_existence: 0.5,
        }
    }
}

impl Fusion {
    /// The lag behind the newest time; zero without a lag.
    pub const fn lag(&self) -> Span {
        match self {
            Self::Tracking(tracking) => tracking.tracker.hypotheses.lag(),
            Self::Window(_) => Span::ZERO,
        }
    }

    /// The lag of the second list, where there is one.
    pub const fn second_lag(&self) -> Option<Span> {
        match self {
            Self::Tracking(tracking) => tracking.tracker.hypotheses.second_lag(),
            Self::Window(_) => None,
        }
    }

    /// The longest lag of a list; zero without a lag.
    pub fn longest_lag(&self) -> Span {
        match self {
            Self::Tracking(tracking) => tracking.tracker.hypotheses.longest_lag(),
            Self::Window(_) => Span::ZERO,
        }
    }

    /// What is done about clock and pose errors of agents. Without tracks no shared objects are known, and nothing is
    /// done.
    pub const fn registration(&self) -> Registration {
        match self {
            Self::Tracking(tracking) => tracking.registration,
            Self::Window(_) => Registration::Off,
        }
    }
}
