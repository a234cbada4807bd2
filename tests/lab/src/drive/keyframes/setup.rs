//! How an engine is set up as one of the compared methods.

use v2x_common::id::HubId;
use v2x_common::time::Span;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::preset;

/// What the engine is asked to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Its rules.
    pub config: EngineConfig,
    /// Whether agents declare by which law their sizes err.
    pub declares_size_law: bool,
    /// How many of the two agents report.
    pub n_agents: usize,
    /// Whether objects are put far apart, so that association cannot fail.
    pub has_true_identities: bool,
    /// Whether it is fed with a list of both agents' instead of one agent's reports.
    pub reads_fused_list: bool,
    /// Whether it knows of earlier keyframes.
    pub remembers: bool,
    /// For how long later keyframes count: a keyframe's answer is asked for when the last of them has come. Zero: at
    /// once.
    pub lag: Span,
}

impl Setup {
    /// A preset of the hub; rules that go by overlap use this threshold.
    pub fn of_preset(key: &str, overlap: f64) -> Self {
        let preset = preset(key).expect("rows name presets of the hub");
        let ours = Self::ours();
        let config = EngineConfig { fusion: preset.fusion_at(overlap), ..ours.config.with_preset(preset) };
        Self { config, ..ours }
    }

    /// The hub's defaults; agents declare everything that there is to declare.
    pub fn ours() -> Self {
        let config = EngineConfig::new(HubId::new("lab").expect("a legal name"), 1);
        Self {
            config,
            declares_size_law: true,
            n_agents: 2,
            has_true_identities: false,
            reads_fused_list: false,
            remembers: true,
            lag: Span::ZERO,
        }
    }
}
