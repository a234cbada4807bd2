//! Fused frames from bytes.

use super::head::ListHead;
use super::limits::{MAX_AGENTS, MAX_INCLUDES, MAX_OBJECTS};
use super::{CONFLICT_SHIFT, HEADING_SHIFT};
use crate::class::Class;
use crate::detection::HeadingKind;
use crate::fused::{AgentHealth, FusedFrame, FusedObject, Inclusion};
use crate::geometry::BevBox;
use crate::id::{AgentId, FrameId, MeasurementId, TrackId};
use crate::time::{Span, Timestamp};
use crate::wire::error::WireError;
use crate::wire::framing::{Kind, checked_count, finish, take_preamble};
use crate::wire::kinematic;
use crate::wire::quantity::{self, MILLI, unfixed};
use crate::wire::varint::Reader;

/// With every integer as short as it gets.
const MIN_OBJECT_LEN: usize = 27;
const MIN_CONTRIBUTOR_LEN: usize = 4;

/// The frame of the bytes.
pub fn decode(bytes: &[u8]) -> Result<FusedFrame, WireError> {
    let mut bytes = bytes;
    take_preamble(&mut bytes, Kind::Fused)?;
    let reader = &mut Reader(bytes);
    let head = ListHead::read(reader)?;
    let (agents, objects, includes) = (reader.u32()?, reader.u32()?, reader.u32()?);
    let n_agents = checked_count("agents", agents, MAX_AGENTS)?;
    let n_objects = checked_count("objects", objects, MAX_OBJECTS)?;
    let n_includes = checked_count("includes", includes, MAX_INCLUDES)?;
    let mut frame = head.frame();
    for _ in 0..n_agents {
        frame.agents.push(read_agent(reader, frame.fused_at)?);
    }
    frame.objects = read_objects(reader, n_objects, &head, Some(&frame.agents))?;
    for _ in 0..n_includes {
        let id = WireFrameId::read(reader)?;
        let (captured, received) = (reader.i64()?, reader.i64()?);
        frame.includes.push(Inclusion {
            frame: id.resolve(&frame.agents)?,
            captured_at: frame.fused_at - Span::from_nanos(captured),
            received_at: frame.fused_at - Span::from_nanos(received),
        });
    }
    finish(reader.0)?;
    Ok(frame)
}

/// Objects whose contributors are of these agents; of a list without agents none has any.
pub(in crate::wire) fn read_objects(
    reader: &mut Reader<'_>,
    count: usize,
    head: &ListHead,
    agents: Option<&[AgentHealth]>,
) -> Result<Vec<FusedObject>, WireError> {
    // The count is not verified yet: reserve no more than the bytes can contain.
    let mut objects = Vec::with_capacity(count.min(reader.0.len() / MIN_OBJECT_LEN));
    for _ in 0..count {
        objects.push(read_object(reader, head, agents)?);
    }
    Ok(objects)
}

fn read_agent(reader: &mut Reader<'_>, fused_at: Timestamp) -> Result<AgentHealth, WireError> {
    let (agent, epoch, newest_before_fused_ns) = (reader.text()?, reader.u64()?, reader.i64()?);
    let (accepted, refused, out_of_sequence) = (reader.u64()?, reader.u64()?, reader.u64()?);
    let newest_captured_at = fused_at - Span::from_nanos(newest_before_fused_ns);
    let agent = AgentId::new(agent)?;
    Ok(AgentHealth { agent, epoch, newest_captured_at, accepted, refused, out_of_sequence })
}

/// Agent by its place in the list, epoch relative to the agent's newest, sequence.
struct WireFrameId(u32, u64, u64);

impl WireFrameId {
    #[inline]
    fn read(reader: &mut Reader<'_>) -> Result<Self, WireError> {
        Ok(Self(reader.u32()?, reader.u64()?, reader.u64()?))
    }

    #[inline]
    fn resolve(&self, agents: &[AgentHealth]) -> Result<FrameId, WireError> {
        let Some(health) = agents.get(self.0 as usize) else { return Err(WireError::UnlistedAgent) };
        Ok(FrameId { agent: health.agent, epoch: self.1 ^ health.epoch, sequence: self.2 })
    }
}

fn read_object(
    reader: &mut Reader<'_>,
    head: &ListHead,
    agents: Option<&[AgentHealth]>,
) -> Result<FusedObject, WireError> {
    let ListHead { lineage, fused_at, origin_m, .. } = *head;
    let (lineage_xor, counter) = (reader.u32()?, reader.u32()?);
    let (x, y) = (reader.i64()?, reader.i64()?);
    let (vx, vy) = (reader.i32()?, reader.i32()?);
    let (w, d, yaw) = (reader.u16()?, reader.u16()?, reader.i16()?);
    let (sigma, rho) = (reader.bytes::<4>()?, reader.bytes::<6>()?.map(u8::cast_signed));
    let [sw, sd, st, existence] = reader.bytes()?;
    let (age_ns, measured_before_fused_ns) = (reader.i64()?, reader.i64()?);
    let (n_classes, n_contributors) = (reader.u32()?, if agents.is_some() { reader.u32()? } else { 0 });
    let n_contributors = checked_count("contributors", n_contributors, MAX_AGENTS)?;
    let (n_classes, above) = (n_classes & ((1 << HEADING_SHIFT) - 1), n_classes >> HEADING_SHIFT);
    let (heading, above) = (above & 3, above >> (CONFLICT_SHIFT - HEADING_SHIFT));
    if above > 1 {
        return Err(unknown_flags(above));
    }
    let heading = HeadingKind::from_byte(heading).ok_or_else(|| unknown_flags(heading))?;
    let n_classes = checked_count("class probabilities", n_classes, Class::ALL.len())?;
    let class_probabilities = read_classes(reader, n_classes)?;
    let class_conflict = if above == 1 { quantity::probability(reader.bytes::<1>()?[0]) } else { 0.0 };
    let contributors = read_contributors(reader, n_contributors, agents.unwrap_or_default())?;
    Ok(FusedObject {
        track: TrackId::new(lineage_xor ^ lineage, counter),
        class: class_probabilities[0].0,
        class_probabilities,
        class_conflict,
        bev: BevBox {
            x: absolute(x, origin_m.0),
            y: absolute(y, origin_m.1),
            w: unfixed(w, MILLI),
            d: unfixed(d, MILLI),
            yaw: quantity::yaw(yaw),
        },
        velocity: (unfixed(vx, MILLI), unfixed(vy, MILLI)),
        kinematic_covariance: kinematic::decode((sigma, rho))?,
        ww: quantity::metric_variance(sw),
        dd: quantity::metric_variance(sd),
        yaw_variance: quantity::yaw_variance(st),
        heading,
        existence: quantity::probability(existence),
        age: Span::from_nanos(age_ns),
        last_measured_at: fused_at - Span::from_nanos(measured_before_fused_ns),
        contributors,
    })
}

fn unknown_flags(flags: u32) -> WireError {
    WireError::UnknownFlags(u8::try_from(flags).unwrap_or(u8::MAX))
}

/// The coordinate of mm from the origin.
fn absolute(millimetres: i64, origin_m: i32) -> f64 {
    quantity::millimetres(millimetres.saturating_add(1000 * i64::from(origin_m)))
}

/// At least one class: an object without any is of class unknown.
fn read_classes(reader: &mut Reader<'_>, count: usize) -> Result<Vec<(Class, f64)>, WireError> {
    if count == 0 {
        return Ok(vec![(Class::Unknown, 1.0)]);
    }
    let mut classes = Vec::with_capacity(count);
    for _ in 0..count {
        let [class, probability] = reader.bytes()?;
        let Some(class) = Class::from_byte(class) else { return Err(WireError::UnknownClass(class)) };
        classes.push((class, quantity::probability(probability)));
    }
    Ok(classes)
}

fn read_contributors(
    reader: &mut Reader<'_>,
    count: usize,
    agents: &[AgentHealth],
) -> Result<Vec<MeasurementId>, WireError> {
    let mut contributors = Vec::with_capacity(count.min(reader.0.len() / MIN_CONTRIBUTOR_LEN));
    for _ in 0..count {
        let (id, index) = (WireFrameId::read(reader)?, reader.u16()?);
        contributors.push(MeasurementId { frame: id.resolve(agents)?, index });
    }
    Ok(contributors)
}
