//! How an engine is set up as one of the compared methods.

use v2x_common::id::HubId;
use v2x_common::time::Span;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::fusion::preset;

/// The setup of an engine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Its configuration.
    pub config: EngineConfig,
    /// Whether agents declare their size noise law.
    pub declares_size_law: bool,
    /// How many of the two agents report.
    pub n_agents: usize,
    /// Whether objects are moved far apart, so that all associations are true.
    pub has_true_identities: bool,
    /// Whether its input is a list of fused objects of both agents, instead of an agent's detections.
    pub reads_fused_list: bool,
    /// Whether it keeps its state between keyframes.
    pub remembers: bool,
    /// A keyframe is published this long after its own time, by all keyframes until then. Zero: at once.
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
