//! Delta frames as JSON.

use super::fused::{JsonObject, check_finite, decode_fused};
use super::values::{Id64, Micros, parse, print};
use crate::fused::FusedObject;
use crate::id::{HubId, MapFrame, TrackId};
use crate::lists::{DeltaFrame, ListUpdate};
use crate::wire::error::WireError;
use crate::wire::framing::wire_count;
use crate::wire::fused::MAX_OBJECTS;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonDelta {
    hub: HubId,
    lineage: u32,
    sequence: Id64,
    fused_at: Micros,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    map_frame: Option<MapFrame>,
    key_sequence: Id64,
    changed: Vec<JsonObject>,
    gone: Vec<Id64>,
}

/// The delta frame as JSON. An object that names contributors is an error.
pub fn encode_delta(delta: &DeltaFrame) -> Result<Vec<u8>, WireError> {
    check_plain(&delta.changed)?;
    delta.changed.iter().try_for_each(check_finite)?;
    print(&JsonDelta {
        hub: delta.hub,
        lineage: delta.lineage,
        sequence: Id64(delta.sequence),
        fused_at: Micros(delta.fused_at),
        map_frame: delta.map_frame,
        key_sequence: Id64(delta.key_sequence),
        changed: delta.changed.iter().map(JsonObject::from).collect(),
        gone: delta.gone.iter().map(|track| Id64(track.0)).collect(),
    })
}

/// The delta frame of a JSON text, if it is within the limits of the schema; times are cut to microseconds.
pub fn decode_delta(bytes: &[u8]) -> Result<DeltaFrame, WireError> {
    let json: JsonDelta = parse(bytes)?;
    wire_count("changed objects", json.changed.len(), MAX_OBJECTS)?;
    wire_count("tracks that are gone", json.gone.len(), MAX_OBJECTS)?;
    (0..).zip(&json.changed).try_for_each(|(index, object)| object.check(index))?;
    let changed: Vec<_> = json.changed.into_iter().map(FusedObject::from).collect();
    check_plain(&changed)?;
    Ok(DeltaFrame {
        hub: json.hub,
        lineage: json.lineage,
        sequence: json.sequence.0,
        fused_at: json.fused_at.0,
        map_frame: json.map_frame,
        key_sequence: json.key_sequence.0,
        changed,
        gone: json.gone.into_iter().map(|track| TrackId(track.0)).collect(),
    })
}

/// The key frame or delta frame of a JSON text: only a delta frame names its key frame.
pub fn decode_update(bytes: &[u8]) -> Result<ListUpdate, WireError> {
    #[derive(Deserialize)]
    struct Named {
        key_sequence: Option<IgnoredAny>,
    }
    match parse::<Named>(bytes)?.key_sequence {
        Some(IgnoredAny) => decode_delta(bytes).map(ListUpdate::Delta),
        None => decode_fused(bytes).map(ListUpdate::Key),
    }
}

/// A delta frame lists no agents that contributors could be of.
fn check_plain(changed: &[FusedObject]) -> Result<(), WireError> {
    let is_plain = changed.iter().all(|object| object.contributors.is_empty());
    if is_plain { Ok(()) } else { Err(WireError::UnlistedAgent) }
}
