//! The engine's settings.

use crate::association::{AssociationConfig, AssociationCost};
use crate::sensing::SensingDefaults;
use crate::track::LateData;
use v2x_common::id::{HubId, MapFrame};
use v2x_common::time::Span;

/// ε_s of the paper.
const EPSILON_S: Span = Span::from_millis(10);

/// Of the likelihood, which weighs by itself what lies within: the gate only saves time. 0.999996 of true pairs are
/// within it; a hub of ten agents makes 10 000 pairs a second, and each one outside begins a second track.
const WIDE_GATE: f64 = 25.0;

/// How objects are taken to move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionModel {
    /// Constant velocity: the paper's UniKF.
    Cv,
    /// Four interacting models: parked, stopped, smooth, manoeuvring.
    #[default]
    Imm,
}

/// A named set of rules.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The best we know.
    #[default]
    Ours,
    /// UniKF as in the paper, with late data replayed: constant velocity, CSBA, ε_s = 10 ms.
    Paper,
    /// UniKF as the paper's text reads literally: what is newer than a late measurement is lost.
    PaperLiteral,
}

/// What an engine is told once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EngineConfig {
    /// Its name in fused frames.
    pub hub: HubId,
    /// New at every start, so that track ids never come back.
    pub lineage: u32,
    /// The coordinate frame of all positions; frames that name another one are refused. Where it is `None`, the
    /// first one that an accepted frame names holds.
    pub map_frame: Option<MapFrame>,
    /// Δmax: frames older, or further in the future, are refused.
    pub delta_max: Span,
    /// How long an object is published without being measured.
    pub coast: Span,
    /// ε_s: frames this near to the newest one count as synchronous.
    pub synchronous: Span,
    /// Reports this near to a track's own time are taken as simultaneous: ε_s in the paper, zero for exact time.
    pub filter_synchronous: Span,
    /// What becomes of measurements newer than a late one.
    pub late_data: LateData,
    /// How objects move.
    pub motion: MotionModel,
    /// Which reports can be of which tracks.
    pub association: AssociationConfig,
    /// How many hypotheses there are about which report was of which track, where that is in doubt
    /// ([`crate::particles`]); below 2 there is one. Several weigh by the likelihood, whatever the cost in
    /// `association`.
    pub association_particles: u32,
    /// Whether classes tell of sizes and of motion at all. Without, sizes are as without `class_size_priors`, and
    /// every class moves as vehicles do.
    pub class_priors: bool,
    /// Whether objects of a class tell of each other's sizes; without, an object's own reports alone do, every
    /// logarithm of a size being as likely as any other at first.
    pub class_size_priors: bool,
    /// Whether it counts by which law a sensor declares that its sizes err; without, they err by a normal
    /// distribution of the stated variance about the true ones.
    pub debias_sizes: bool,
    /// Probability of existence from which on an object is published.
    pub publish_existence: f64,
    /// What is assumed where agents say nothing.
    pub sensing: SensingDefaults,
}

impl EngineConfig {
    /// The defaults, for a hub of this name: Δmax of the paper (500 ms), the gate of METHODS.md 12.
    pub fn new(hub: HubId, lineage: u32) -> Self {
        Self {
            hub,
            lineage,
            map_frame: None,
            delta_max: Span::from_millis(500),
            coast: Span::from_millis(1500),
            synchronous: EPSILON_S,
            filter_synchronous: Span::ZERO,
            late_data: LateData::Replay,
            motion: MotionModel::default(),
            association: AssociationConfig {
                cost: AssociationCost::Likelihood,
                gate: WIDE_GATE,
                ..AssociationConfig::default()
            },
            association_particles: 0,
            class_priors: true,
            class_size_priors: true,
            debias_sizes: true,
            publish_existence: 0.5,
            sensing: SensingDefaults::default(),
        }
    }
    /// With the rules of a preset.
    #[must_use]
    pub fn with_preset(self, preset: Preset) -> Self {
        let paper = Self {
            filter_synchronous: EPSILON_S,
            motion: MotionModel::Cv,
            association: AssociationConfig::default(),
            association_particles: 0,
            ..self
        };
        match preset {
            Preset::Ours => self,
            Preset::Paper => paper,
            Preset::PaperLiteral => Self { late_data: LateData::RollbackOnly, ..paper },
        }
    }
}
