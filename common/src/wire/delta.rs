//! Delta frames as bytes: the head of a fused frame, the distance to the key frame, the objects as fused frames have them but
//! without a number of contributors, and the tracks that are gone.

use super::error::{VERSION, WireError};
use super::framing::{Kind, checked_count, finish, take_preamble, wire_count};
use super::fused::{self, ListHead, MAX_HEAD_LEN, MAX_OBJECTS, origin_m, read_objects, write_objects};
use super::varint::{MAX_LEN_32, MAX_LEN_64, Reader, Writer, append};
use crate::id::TrackId;
use crate::lists::{DeltaFrame, ListUpdate};

/// Preamble, distance and two counts.
const MAX_DELTA_HEAD_LEN: usize = 2 + MAX_HEAD_LEN + MAX_LEN_64 + 2 * MAX_LEN_32;
const MAX_TRACK_LEN: usize = 2 * MAX_LEN_32;
const MIN_TRACK_LEN: usize = 2;

/// Appends the frame to the buffer, in version [`VERSION`]. On an error, such as an object that names contributors, the
/// buffer is as it was.
pub fn encode(delta: &DeltaFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    let start = buffer.len();
    write(delta, buffer).inspect_err(|_| buffer.truncate(start))
}

/// The delta frame of the bytes.
pub fn decode(bytes: &[u8]) -> Result<DeltaFrame, WireError> {
    let mut bytes = bytes;
    take_preamble(&mut bytes, Kind::Delta)?;
    let reader = &mut Reader(bytes);
    let head = ListHead::read(reader)?;
    let (distance, n_changed, n_gone) = (reader.u64()?, reader.u32()?, reader.u32()?);
    let n_changed = checked_count("changed objects", n_changed, MAX_OBJECTS)?;
    let n_gone = checked_count("tracks that are gone", n_gone, MAX_OBJECTS)?;
    let changed = read_objects(reader, n_changed, &head, None)?;
    let gone = read_tracks(reader, n_gone, head.lineage)?;
    finish(reader.0)?;
    Ok(DeltaFrame {
        hub: head.hub,
        lineage: head.lineage,
        sequence: head.sequence,
        fused_at: head.fused_at,
        map_frame: head.map_frame,
        key_sequence: head.sequence.wrapping_sub(distance),
        changed,
        gone,
    })
}

/// The key frame or delta frame of the bytes, as their kind says.
pub fn decode_update(bytes: &[u8]) -> Result<ListUpdate, WireError> {
    match bytes {
        [_, kind, ..] if *kind == Kind::Fused as u8 => fused::decode(bytes).map(ListUpdate::Key),
        _ => decode(bytes).map(ListUpdate::Delta),
    }
}

fn write(delta: &DeltaFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    let DeltaFrame { hub, lineage, sequence, fused_at, map_frame, .. } = *delta;
    let origin_m = origin_m(&delta.changed)?;
    let head = ListHead { hub, lineage, sequence, fused_at, map_frame, origin_m };
    append(buffer, MAX_DELTA_HEAD_LEN, |writer| write_head(delta, &head, writer))?;
    write_objects(&delta.changed, &head, None, buffer)?;
    append(buffer, MAX_TRACK_LEN * delta.gone.len(), |writer| {
        for track in &delta.gone {
            writer.u32(track.lineage() ^ lineage);
            writer.u32(track.counter());
        }
        Ok(())
    })
}

fn write_head(delta: &DeltaFrame, head: &ListHead, writer: &mut Writer<'_>) -> Result<(), WireError> {
    let n_changed = wire_count("changed objects", delta.changed.len(), MAX_OBJECTS)?;
    let n_gone = wire_count("tracks that are gone", delta.gone.len(), MAX_OBJECTS)?;
    writer.bytes([VERSION, Kind::Delta as u8]);
    head.write(writer);
    writer.u64(delta.sequence.wrapping_sub(delta.key_sequence));
    writer.u32(n_changed);
    writer.u32(n_gone);
    Ok(())
}

fn read_tracks(reader: &mut Reader<'_>, count: usize, lineage: u32) -> Result<Vec<TrackId>, WireError> {
    // The count is not verified yet: reserve no more than the bytes can contain.
    let mut tracks = Vec::with_capacity(count.min(reader.0.len() / MIN_TRACK_LEN));
    for _ in 0..count {
        let (lineage_xor, counter) = (reader.u32()?, reader.u32()?);
        tracks.push(TrackId::new(lineage_xor ^ lineage, counter));
    }
    Ok(tracks)
}
