//! Fused frames as JSON.

mod object;

use super::values::{Id64, Micros, parse, print};
use crate::fused::{AgentHealth, FusedFrame, FusedObject, Inclusion};
use crate::id::{AgentId, FrameId, HubId, MapFrame};
use crate::wire::error::WireError;
use crate::wire::framing::wire_count;
use crate::wire::fused::{MAX_AGENTS, MAX_INCLUDES, MAX_OBJECTS};
pub(super) use object::{JsonObject, check_finite};
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonFused {
    hub: HubId,
    lineage: u32,
    sequence: Id64,
    fused_at: Micros,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    map_frame: Option<MapFrame>,
    objects: Vec<JsonObject>,
    agents: Vec<JsonAgent>,
    includes: Vec<JsonInclusion>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonAgent {
    agent: AgentId,
    epoch: Id64,
    newest_captured_at: Micros,
    accepted: u64,
    refused: u64,
    out_of_sequence: u64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonInclusion {
    agent: AgentId,
    epoch: Id64,
    sequence: Id64,
    captured_at: Micros,
    received_at: Micros,
}

impl From<&AgentHealth> for JsonAgent {
    fn from(health: &AgentHealth) -> Self {
        Self {
            agent: health.agent,
            epoch: Id64(health.epoch),
            newest_captured_at: Micros(health.newest_captured_at),
            accepted: health.accepted,
            refused: health.refused,
            out_of_sequence: health.out_of_sequence,
        }
    }
}

impl From<JsonAgent> for AgentHealth {
    fn from(json: JsonAgent) -> Self {
        Self {
            agent: json.agent,
            epoch: json.epoch.0,
            newest_captured_at: json.newest_captured_at.0,
            accepted: json.accepted,
            refused: json.refused,
            out_of_sequence: json.out_of_sequence,
        }
    }
}

impl From<&Inclusion> for JsonInclusion {
    fn from(inclusion: &Inclusion) -> Self {
        Self {
            agent: inclusion.frame.agent,
            epoch: Id64(inclusion.frame.epoch),
            sequence: Id64(inclusion.frame.sequence),
            captured_at: Micros(inclusion.captured_at),
            received_at: Micros(inclusion.received_at),
        }
    }
}

impl From<JsonInclusion> for Inclusion {
    fn from(json: JsonInclusion) -> Self {
        Self {
            frame: FrameId { agent: json.agent, epoch: json.epoch.0, sequence: json.sequence.0 },
            captured_at: json.captured_at.0,
            received_at: json.received_at.0,
        }
    }
}

/// The frame as JSON.
pub fn encode_fused(frame: &FusedFrame) -> Result<Vec<u8>, WireError> {
    frame.objects.iter().try_for_each(check_finite)?;
    print(&JsonFused {
        hub: frame.hub,
        lineage: frame.lineage,
        sequence: Id64(frame.sequence),
        fused_at: Micros(frame.fused_at),
        map_frame: frame.map_frame,
        objects: frame.objects.iter().map(JsonObject::from).collect(),
        agents: frame.agents.iter().map(JsonAgent::from).collect(),
        includes: frame.includes.iter().map(JsonInclusion::from).collect(),
    })
}

/// The frame of a JSON text, if it is within the limits of the schema; times are cut to microseconds.
pub fn decode_fused(bytes: &[u8]) -> Result<FusedFrame, WireError> {
    let json: JsonFused = parse(bytes)?;
    wire_count("objects", json.objects.len(), MAX_OBJECTS)?;
    wire_count("agents", json.agents.len(), MAX_AGENTS)?;
    wire_count("includes", json.includes.len(), MAX_INCLUDES)?;
    (0..).zip(&json.objects).try_for_each(|(index, object)| object.check(index))?;
    Ok(FusedFrame {
        hub: json.hub,
        lineage: json.lineage,
        sequence: json.sequence.0,
        fused_at: json.fused_at.0,
        map_frame: json.map_frame,
        objects: json.objects.into_iter().map(FusedObject::from).collect(),
        agents: json.agents.into_iter().map(AgentHealth::from).collect(),
        includes: json.includes.into_iter().map(Inclusion::from).collect(),
    })
}
