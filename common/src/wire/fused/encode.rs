//! Fused frames into bytes.

use super::head::{ListHead, MAX_HEAD_LEN};
use super::limits::{MAX_AGENTS, MAX_INCLUDES, MAX_OBJECTS};
use super::{CONFLICT_SHIFT, HEADING_SHIFT};
use crate::class::Class;
use crate::fused::{AgentHealth, FusedFrame, FusedObject};
use crate::id::{AgentId, FrameId, MAX_NAME_LEN};
use crate::time::Timestamp;
use crate::wire::error::{VERSION, WireError};
use crate::wire::framing::{Kind, wire_count};
use crate::wire::kinematic;
use crate::wire::quantity::{self, MILLI, fixed};
use crate::wire::varint::{MAX_LEN_16, MAX_LEN_32, MAX_LEN_64, Writer, append};

/// Preamble, and three counts behind the head.
const MAX_FUSED_HEAD_LEN: usize = 2 + MAX_HEAD_LEN + 3 * MAX_LEN_32;
/// The name with its length; epoch, time, counts.
const MAX_AGENT_LEN: usize = MAX_NAME_LEN + 1 + 5 * MAX_LEN_64;
/// 15 single bytes; sizes and heading; track, velocity, counts; position and times.
const MAX_OBJECT_LEN: usize = 15 + 3 * MAX_LEN_16 + 6 * MAX_LEN_32 + 4 * MAX_LEN_64;
const CLASS_LEN: usize = 2;
const MAX_FRAME_ID_LEN: usize = MAX_LEN_32 + 2 * MAX_LEN_64;
const MAX_CONTRIBUTOR_LEN: usize = MAX_FRAME_ID_LEN + MAX_LEN_16;
const MAX_INCLUSION_LEN: usize = MAX_FRAME_ID_LEN + 2 * MAX_LEN_64;

/// Appends the frame to the buffer, in version [`VERSION`].
///
/// Every agent that an object or an inclusion refers to must be in `frame.agents`, which is sorted. On an
/// error the buffer is as it was.
///
/// Allocates nothing where the buffer's capacity suffices: it makes room for the longest numbers.
pub fn encode(frame: &FusedFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    let start = buffer.len();
    write(frame, buffer).inspect_err(|_| buffer.truncate(start))
}

fn write(frame: &FusedFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    let head = ListHead::of(frame)?;
    append(buffer, MAX_FUSED_HEAD_LEN, |writer| write_head(frame, &head, writer))?;
    for health in &frame.agents {
        append(buffer, MAX_AGENT_LEN, |writer| write_agent(health, frame.fused_at, writer))?;
    }
    write_objects(&frame.objects, &head, Some(&frame.agents), buffer)?;
    for inclusion in &frame.includes {
        append(buffer, MAX_INCLUSION_LEN, |writer| {
            write_frame_id(&inclusion.frame, &frame.agents, &mut 0, writer)?;
            writer.i64((frame.fused_at - inclusion.captured_at).as_nanos());
            writer.i64((frame.fused_at - inclusion.received_at).as_nanos());
            Ok::<_, WireError>(())
        })?;
    }
    Ok(())
}

/// Objects whose contributors are of these agents; of a list without agents none has any, which takes no byte.
///
/// Makes room for one object at a time: room for the longest numbers of all would not fit into the cache.
pub(in crate::wire) fn write_objects(
    objects: &[FusedObject],
    head: &ListHead,
    agents: Option<&[AgentHealth]>,
    buffer: &mut Vec<u8>,
) -> Result<(), WireError> {
    for object in objects {
        // More of either cannot be sent.
        let n_classes = object.classes().count().min(Class::ALL.len());
        let n_contributors = object.contributors.len().min(MAX_AGENTS);
        let room = MAX_OBJECT_LEN + CLASS_LEN * n_classes + MAX_CONTRIBUTOR_LEN * n_contributors;
        append(buffer, room, |writer| {
            write_object(object, head, writer)?;
            match agents {
                Some(_) => writer.u32(wire_count("contributors", object.contributors.len(), MAX_AGENTS)?),
                None if object.contributors.is_empty() => {}
                None => return Err(WireError::UnlistedAgent),
            }
            write_classes(object, writer)?;
            write_contributors(object, agents.unwrap_or_default(), writer)
        })?;
    }
    Ok(())
}

fn write_head(frame: &FusedFrame, head: &ListHead, writer: &mut Writer<'_>) -> Result<(), WireError> {
    let n_agents = wire_count("agents", frame.agents.len(), MAX_AGENTS)?;
    let n_objects = wire_count("objects", frame.objects.len(), MAX_OBJECTS)?;
    let n_includes = wire_count("includes", frame.includes.len(), MAX_INCLUDES)?;
    writer.bytes([VERSION, Kind::Fused as u8]);
    head.write(writer);
    [n_agents, n_objects, n_includes].into_iter().for_each(|count| writer.u32(count));
    Ok(())
}

fn write_agent(health: &AgentHealth, fused_at: Timestamp, writer: &mut Writer<'_>) -> Result<(), WireError> {
    writer.text(health.agent.as_str());
    writer.u64(health.epoch);
    writer.i64((fused_at - health.newest_captured_at).as_nanos());
    writer.u64(health.accepted);
    writer.u64(health.refused);
    writer.u64(health.out_of_sequence);
    Ok(())
}

/// A coordinate in mm from the origin.
fn relative(field: &'static str, value: f64, origin_m: i32) -> Result<i64, WireError> {
    let millimetres: i64 = fixed(field, value, MILLI)?;
    Ok(millimetres - 1000 * i64::from(origin_m))
}

/// Agent by its place in the list, epoch relative to the agent's newest, sequence. `expected` is where the
/// agent most likely stands in the list: references mostly come in its order.
#[inline(always)]
fn write_frame_id(
    id: &FrameId,
    agents: &[AgentHealth],
    expected: &mut u32,
    writer: &mut Writer<'_>,
) -> Result<(), WireError> {
    let place = match agents.get(*expected as usize) {
        Some(health) if health.agent == id.agent => *expected,
        _ => place_of(id.agent, agents)?,
    };
    *expected = place + 1;
    writer.u32(place);
    writer.u64(id.epoch ^ agents[place as usize].epoch);
    writer.u64(id.sequence);
    Ok(())
}

#[cold]
fn place_of(agent: AgentId, agents: &[AgentHealth]) -> Result<u32, WireError> {
    let found = agents.binary_search_by_key(&agent, |health| health.agent);
    wire_count("agents", found.map_err(|_| WireError::UnlistedAgent)?, MAX_AGENTS)
}

/// Track, mostly of this lineage; position relative to the origin, sizes: mm; velocity: mm/s; heading: 0.1 mrad;
/// one byte for each standard deviation, correlation and probability; times: ns.
fn write_object(object: &FusedObject, head: &ListHead, writer: &mut Writer<'_>) -> Result<(), WireError> {
    let FusedObject { bev, .. } = object;
    let ListHead { lineage, fused_at, origin_m, .. } = *head;
    writer.u32(object.track.lineage() ^ lineage);
    writer.u32(object.track.counter());
    writer.i64(relative("x", bev.x, origin_m.0)?);
    writer.i64(relative("y", bev.y, origin_m.1)?);
    writer.i32(fixed("vx", object.velocity.0, MILLI)?);
    writer.i32(fixed("vy", object.velocity.1, MILLI)?);
    writer.u16(fixed("w", bev.w, MILLI)?);
    writer.u16(fixed("d", bev.d, MILLI)?);
    writer.i16(quantity::yaw_steps("yaw", bev.yaw)?);
    let (sigma, rho) = kinematic::encode(&object.kinematic_covariance)?;
    writer.bytes(sigma);
    writer.bytes(rho.map(i8::cast_unsigned));
    let sw = quantity::metric_sigma("variance of w", object.ww)?;
    let sd = quantity::metric_sigma("variance of d", object.dd)?;
    let st = quantity::yaw_sigma("variance of yaw", object.yaw_variance)?;
    let existence = quantity::probability_byte("existence", object.existence)?;
    writer.bytes([sw, sd, st, existence]);
    writer.i64(object.age.as_nanos());
    writer.i64((fused_at - object.last_measured_at).as_nanos());
    let n_classes = wire_count("class probabilities", object.classes().count(), Class::ALL.len())?;
    let has_conflict = u32::from(conflict_byte(object)? > 0);
    writer.u32(n_classes | (object.heading as u32) << HEADING_SHIFT | has_conflict << CONFLICT_SHIFT);
    Ok(())
}

fn conflict_byte(object: &FusedObject) -> Result<u8, WireError> {
    quantity::probability_byte("class conflict", object.class_conflict)
}

fn write_classes(object: &FusedObject, writer: &mut Writer<'_>) -> Result<(), WireError> {
    for (class, probability) in object.classes() {
        writer.bytes([class.byte(), quantity::probability_byte("class probability", probability)?]);
    }
    let conflict = conflict_byte(object)?;
    if conflict > 0 {
        writer.bytes([conflict]);
    }
    Ok(())
}

fn write_contributors(
    object: &FusedObject,
    agents: &[AgentHealth],
    writer: &mut Writer<'_>,
) -> Result<(), WireError> {
    let mut expected = 0;
    for measurement in &object.contributors {
        write_frame_id(&measurement.frame, agents, &mut expected, writer)?;
        writer.u16(measurement.index);
    }
    Ok(())
}
