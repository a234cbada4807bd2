//! The engine's settings.

use crate::association::{AssociationConfig, AssociationCost};
use crate::method::{Method, WindowConfig};
use crate::registration::Registration;
use crate::sensing::SensingDefaults;
use crate::track::LateData;
use v2x_common::id::{HubId, MapFrame};
use v2x_common::time::Span;

/// The overlap above which boxes are of one object, for methods that go by it (paper, Table I: Noise 1 and 2).
pub const DEFAULT_OVERLAP: f64 = 0.5;
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
    /// Where a method without memory fuses instead of tracks, its rule and window; all about tracks is then without
    /// effect.
    pub window: Option<WindowConfig>,
    /// Fixed lag: objects are told as they stood so long ago, by everything known by now (Rauch, Tung & Striebel
    /// 1965). Zero: as they stand now. Several association particles are not smoothed together: with a lag the
    /// leading one is told.
    pub lag: Span,
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
    /// Whether two tracks that frames show to be of one object are made one ([`crate::duplicates`]).
    pub resolve_duplicates: bool,
    /// Whether a blurred frame is associated again after a much sharper one of the same instant.
    pub reconsider: bool,
    /// Whether classes tell of sizes and of motion at all. Without, sizes are as without `class_size_priors`, and
    /// every class moves as vehicles do.
    pub class_priors: bool,
    /// Whether objects of a class tell of each other's sizes; without, an object's own reports alone do, every
    /// logarithm of a size being as likely as any other at first.
    pub class_size_priors: bool,
    /// Whether it counts by which law a sensor declares that its sizes err; without, they err by a normal
    /// distribution of the stated variance about the true ones.
    pub debias_sizes: bool,
    /// What is done about agents' clock and pose errors ([`crate::registration`]). It needs tracks
    /// and stamps: without effect under methods without memory, and where delays are ignored.
    pub registration: Registration,
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
            window: None,
            lag: Span::ZERO,
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
            resolve_duplicates: true,
            reconsider: true,
            class_priors: true,
            class_size_priors: true,
            debias_sizes: true,
            registration: Registration::default(),
            publish_existence: 0.5,
            sensing: SensingDefaults::default(),
        }
    }

    /// How long what was measured is held: late data may come within Δmax, and what is told may be a lag old.
    pub fn memory(&self) -> Span {
        self.delta_max.max(self.lag)
    }

    /// With the rules of a method. Those without memory fuse what the paper's window of 100 ms holds, by the overlap
    /// [`DEFAULT_OVERLAP`], the first agent by name as the main one; see [`EngineConfig::window`] for others.
    #[must_use]
    pub fn with_method(self, method: Method) -> Self {
        let paper = Self {
            filter_synchronous: EPSILON_S,
            motion: MotionModel::Cv,
            association: AssociationConfig::default(),
            association_particles: 0,
            registration: Registration::Off,
            // The paper has neither: a track is a track, and every frame is associated once, as it comes.
            resolve_duplicates: false,
            reconsider: false,
            ..self
        };
        match method {
            Method::Ours => self,
            Method::UnikfPaper => paper,
            Method::UnikfLiteral => Self { late_data: LateData::RollbackOnly, ..paper },
            rule => Self { window: rule.rule(DEFAULT_OVERLAP).map(WindowConfig::new), ..self },
        }
    }
}
