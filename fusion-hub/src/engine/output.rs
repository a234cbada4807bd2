//! The fused frames of one list: the live one, or one that is a lag behind.

use super::agents::AgentRegistry;
use super::config::EngineConfig;
use crate::values::saved;
use v2x_common::fused::{FusedFrame, Inclusion};
use v2x_common::id::MapFrame;
use v2x_common::time::Timestamp;

/// The newest frame of a list; its buffers are used again.
#[derive(Debug)]
pub(super) struct Output {
    pub(super) frame: FusedFrame,
    sequence: u64,
}

/// The list, and the second one, which is a lag behind.
#[derive(Debug)]
pub(super) struct Outputs {
    pub(super) first: Output,
    pub(super) second: Output,
}

saved!([] Output, saved { sequence }, made_anew { frame });
saved!([] Outputs, saved { first, second }, made_anew {});

impl Outputs {
    pub(super) const fn new(config: &EngineConfig) -> Self {
        Self { first: Output::new(config), second: Output::new(config) }
    }
}

impl Output {
    pub(super) const fn new(config: &EngineConfig) -> Self {
        let frame = FusedFrame {
            hub: config.hub,
            lineage: config.lineage,
            sequence: 0,
            fused_at: Timestamp::EPOCH,
            map_frame: None,
            objects: Vec::new(),
            agents: Vec::new(),
            includes: Vec::new(),
        };
        Self { frame, sequence: 0 }
    }

    /// Makes the next frame, except for its objects; it names these frames as new.
    pub(super) fn begin(
        &mut self,
        fused_at: Timestamp,
        map_frame: Option<MapFrame>,
        agents: &AgentRegistry,
        new: &mut Vec<Inclusion>,
    ) {
        let frame = &mut self.frame;
        frame.sequence = self.sequence;
        self.sequence += 1;
        frame.fused_at = fused_at;
        frame.map_frame = map_frame;
        frame.agents.clear();
        frame.agents.extend(agents.iter().map(|(agent, record)| record.health(*agent)));
        frame.includes.clear();
        frame.includes.append(new);
    }
}
