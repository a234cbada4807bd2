//! Lists as bytes, with all objects that the wire has room for.

use std::borrow::Cow;
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::wire::{self, WireError};

/// Encodes a frame as it is published; what was encoded. Objects for which the wire has no room are left out of it: one absurd
/// object must not silence all others.
///
/// # Errors
/// Where the rest of the frame has values for which the wire has no room.
pub fn encode_list<'a>(
    frame: &'a FusedFrame,
    buffer: &mut Vec<u8>,
) -> Result<Cow<'a, FusedFrame>, WireError> {
    buffer.clear();
    let Err(error) = wire::fused::encode(frame, buffer) else { return Ok(Cow::Borrowed(frame)) };
    let mut probe = frame.without_lists();
    probe.agents.clone_from(&frame.agents);
    let mut scratch = Vec::new();
    let mut fits = |object: &&FusedObject| {
        probe.objects.clear();
        probe.objects.push((*object).clone());
        scratch.clear();
        wire::fused::encode(&probe, &mut scratch).is_ok()
    };
    let objects: Vec<_> =
        frame.objects.iter().filter(|object| fits(object)).take(wire::fused::MAX_OBJECTS).cloned().collect();
    let withheld = frame.objects.len() - objects.len();
    tracing::warn!(%error, withheld, "objects for which the wire has no room");
    buffer.clear();
    let (agents, includes) = (frame.agents.clone(), frame.includes.clone());
    let encodable = FusedFrame { objects, agents, includes, ..frame.without_lists() };
    wire::fused::encode(&encodable, buffer)?;
    Ok(Cow::Owned(encodable))
}
