//! The engine's settings.

use crate::fusion::{EPSILON_S, Fusion, LateFrames, Lifetimes, Preset, TrackingConfig};
use crate::values::{Coast, ContributorLimit, SensingDefaults};
use serde::{Deserialize, Serialize};
use v2x_common::id::{HubId, MapFrame};
use v2x_common::time::Span;

/// The settings of an engine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EngineConfig {
    /// The hub's name in fused frames.
    pub hub: HubId,
    /// New at every start, so that track ids never come back.
    pub lineage: u32,
    /// The coordinate frame of all positions; frames that name another one are refused. Where it is `None`, the first
    /// one that an admitted frame names holds.
    pub map_frame: Option<MapFrame>,
    /// Δmax: frames older, or further in the future, are refused.
    pub delta_max: Span,
    /// How long an object is published without being detected.
    pub coast: Coast,
    /// ε_s: frames this near to the newest one count as synchronous.
    pub synchronous: Span,
    /// What becomes of frames that arrive after newer ones.
    pub late_frames: LateFrames,
    /// What is assumed of sensors where agents declare nothing.
    pub sensing: SensingDefaults,
    /// Whether a declared law of size errors is corrected; without, sizes err by a normal distribution of the stated
    /// variance about the true ones.
    pub debias_sizes: bool,
    /// How many contributors an object names.
    pub contributors: ContributorLimit,
    /// How it fuses.
    pub fusion: Fusion,
}

impl EngineConfig {
    /// The defaults, for a hub of this name: Δmax of the paper (500 ms).
    pub fn new(hub: HubId, lineage: u32) -> Self {
        Self {
            hub,
            lineage,
            map_frame: None,
            delta_max: Span::from_millis(500),
            coast: Coast::default(),
            synchronous: EPSILON_S,
            late_frames: LateFrames::default(),
            sensing: SensingDefaults::default(),
            debias_sizes: true,
            contributors: ContributorLimit::All,
            fusion: Fusion::default(),
        }
    }

    /// With settings of tracking changed; without effect under a single-frame rule.
    #[must_use]
    pub fn with_tracking(mut self, change: impl FnOnce(&mut TrackingConfig)) -> Self {
        if let Fusion::Tracking(tracking) = &mut self.fusion {
            change(tracking);
        }
        self
    }

    /// With a preset: how it fuses, what becomes of late frames, and whether sizes are debiased.
    #[must_use]
    pub fn with_preset(self, preset: &Preset) -> Self {
        let Preset { coast, late_frames, debias_sizes, .. } = *preset;
        Self { fusion: preset.fusion(), coast, late_frames, debias_sizes, ..self }
    }

    /// How long history is held: late data may arrive within Δmax, and what is published may be a lag old.
    pub fn memory(&self) -> Span {
        self.delta_max.max(self.fusion.longest_lag())
    }

    pub(super) const fn lifetimes(&self) -> Lifetimes {
        Lifetimes { delta_max: self.delta_max, coast: self.coast }
    }
}
