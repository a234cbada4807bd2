//! Fused frames as bytes.

use super::kinematic::{self, WireKinematic};
use super::quantity::{self, MILLI, fixed, unfixed};
use super::{Kind, VERSION, WireError, checked_count, finish, put, take, take_preamble, wire_count};
use crate::class::Class;
use crate::fused::{AgentHealth, FusedFrame, FusedObject, Inclusion};
use crate::geometry::BevBox;
use crate::id::{AgentId, FrameId, HubId, MapFrame, MeasurementId, TrackId};
use crate::time::{Span, Timestamp};
use serde::{Deserialize, Serialize};

/// Most objects in one frame.
pub const MAX_OBJECTS: usize = 65_536;
/// Most agents in one frame.
pub const MAX_AGENTS: usize = 4096;
/// Most detection frames that one fused frame newly includes.
pub const MAX_INCLUDES: usize = 65_536;

#[derive(Serialize, Deserialize)]
struct Header<'a> {
    hub: &'a str,
    lineage: u32,
    sequence: u64,
    fused_at_ns: i64,
    map_frame: Option<&'a str>,
    /// Whole metres, to which the objects' millimetres are relative.
    origin_m: (i32, i32),
    agents: u32,
    objects: u32,
    includes: u32,
}

#[derive(Serialize, Deserialize)]
struct WireAgent<'a> {
    agent: &'a str,
    epoch: u64,
    newest_before_fused_ns: i64,
    accepted: u64,
    refused: u64,
    out_of_sequence: u64,
}

#[derive(Serialize, Deserialize)]
struct WireObject {
    /// Mostly zero: the track began under the hub that tells of it.
    lineage_xor: u32,
    counter: u32,
    x: i64,
    y: i64,
    vx: i32,
    vy: i32,
    w: u16,
    d: u16,
    yaw: i16,
    kinematic: WireKinematic,
    sw: u8,
    sd: u8,
    st: u8,
    existence: u8,
    age_ns: i64,
    measured_before_fused_ns: i64,
    classes: u32,
    contributors: u32,
}

/// Agent by its place in the list, epoch relative to the agent's newest, sequence.
#[derive(Serialize, Deserialize)]
struct WireFrameId(u32, u64, u64);

/// Captured and received, both as ns before `fused_at`.
#[derive(Serialize, Deserialize)]
struct WireInclusion(WireFrameId, i64, i64);

/// Appends the frame to the buffer, in version [`VERSION`].
///
/// Every agent that an object or an inclusion refers to must stand in `frame.agents`, which is sorted.
pub fn encode(frame: &FusedFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    buffer.extend([VERSION, Kind::Fused as u8]);
    let header = Header {
        hub: frame.hub.as_str(),
        lineage: frame.lineage,
        sequence: frame.sequence,
        fused_at_ns: frame.fused_at.as_nanos(),
        map_frame: frame.map_frame.as_ref().map(MapFrame::as_str),
        origin_m: origin_m(frame)?,
        agents: wire_count("agents", frame.agents.len(), MAX_AGENTS)?,
        objects: wire_count("objects", frame.objects.len(), MAX_OBJECTS)?,
        includes: wire_count("includes", frame.includes.len(), MAX_INCLUDES)?,
    };
    put(&header, buffer)?;
    for health in &frame.agents {
        let wire = WireAgent {
            agent: health.agent.as_str(),
            epoch: health.epoch,
            newest_before_fused_ns: (frame.fused_at - health.newest_captured_at).as_nanos(),
            accepted: health.accepted,
            refused: health.refused,
            out_of_sequence: health.out_of_sequence,
        };
        put(&wire, buffer)?;
    }
    for object in &frame.objects {
        encode_object(object, frame, header.origin_m, buffer)?;
    }
    for inclusion in &frame.includes {
        let captured = (frame.fused_at - inclusion.captured_at).as_nanos();
        let received = (frame.fused_at - inclusion.received_at).as_nanos();
        put(
            &WireInclusion(wire_frame_id(&inclusion.frame, &frame.agents, &mut 0)?, captured, received),
            buffer,
        )?;
    }
    Ok(())
}

/// The whole metres at or below the first object: taken from its millimetres, so that what was decoded
/// has the same origin again.
fn origin_m(frame: &FusedFrame) -> Result<(i32, i32), WireError> {
    let Some(FusedObject { bev, .. }) = frame.objects.first() else { return Ok((0, 0)) };
    let metres = |field, value| -> Result<i32, WireError> {
        let millimetres: i64 = fixed(field, value, MILLI)?;
        i32::try_from(millimetres.div_euclid(1000)).map_err(|_| WireError::NotEncodable { field, value })
    };
    Ok((metres("x", bev.x)?, metres("y", bev.y)?))
}

/// A coordinate in mm from the origin.
fn relative(field: &'static str, value: f64, origin_m: i32) -> Result<i64, WireError> {
    let millimetres: i64 = fixed(field, value, MILLI)?;
    Ok(millimetres - 1000 * i64::from(origin_m))
}

/// The coordinate of mm from the origin.
fn absolute(millimetres: i64, origin_m: i32) -> f64 {
    quantity::millimetres(millimetres.saturating_add(1000 * i64::from(origin_m)))
}

/// `expected` is where the agent most likely stands in the list: references mostly come in its order.
fn wire_frame_id(
    id: &FrameId,
    agents: &[AgentHealth],
    expected: &mut usize,
) -> Result<WireFrameId, WireError> {
    let mut place = *expected;
    if agents.get(place).is_none_or(|health| health.agent != id.agent) {
        let found = agents.binary_search_by_key(&id.agent, |health| health.agent);
        place = found.map_err(|_| WireError::UnlistedAgent)?;
    }
    *expected = place + 1;
    let index = wire_count("agents", place, MAX_AGENTS)?;
    Ok(WireFrameId(index, id.epoch ^ agents[place].epoch, id.sequence))
}

fn encode_object(
    object: &FusedObject,
    frame: &FusedFrame,
    origin_m: (i32, i32),
    buffer: &mut Vec<u8>,
) -> Result<(), WireError> {
    let FusedObject { bev, .. } = object;
    let wire = WireObject {
        lineage_xor: object.track.lineage() ^ frame.lineage,
        counter: object.track.counter(),
        x: relative("x", bev.x, origin_m.0)?,
        y: relative("y", bev.y, origin_m.1)?,
        vx: fixed("vx", object.velocity.0, MILLI)?,
        vy: fixed("vy", object.velocity.1, MILLI)?,
        w: fixed("w", bev.w, MILLI)?,
        d: fixed("d", bev.d, MILLI)?,
        yaw: quantity::yaw_steps("yaw", bev.yaw)?,
        kinematic: kinematic::encode(&object.kinematic_covariance)?,
        sw: quantity::metric_sigma("variance of w", object.ww)?,
        sd: quantity::metric_sigma("variance of d", object.dd)?,
        st: quantity::yaw_sigma("variance of yaw", object.yaw_variance)?,
        existence: quantity::probability_byte("existence", object.existence)?,
        age_ns: object.age.as_nanos(),
        measured_before_fused_ns: (frame.fused_at - object.last_measured_at).as_nanos(),
        classes: wire_count("class probabilities", object.class_probabilities.len(), Class::ALL.len())?,
        contributors: wire_count("contributors", object.contributors.len(), MAX_AGENTS)?,
    };
    put(&wire, buffer)?;
    for (class, probability) in &object.class_probabilities {
        put(&(class.byte(), quantity::probability_byte("class probability", *probability)?), buffer)?;
    }
    let mut expected = 0;
    for measurement in &object.contributors {
        let id = wire_frame_id(&measurement.frame, &frame.agents, &mut expected)?;
        put(&(id, measurement.index), buffer)?;
    }
    Ok(())
}

/// The frame of the bytes.
pub fn decode(bytes: &[u8]) -> Result<FusedFrame, WireError> {
    let mut bytes = bytes;
    take_preamble(&mut bytes, Kind::Fused)?;
    let header: Header<'_> = take(&mut bytes)?;
    let n_agents = checked_count("agents", header.agents, MAX_AGENTS)?;
    let n_objects = checked_count("objects", header.objects, MAX_OBJECTS)?;
    let n_includes = checked_count("includes", header.includes, MAX_INCLUDES)?;
    let mut frame = FusedFrame {
        hub: HubId::new(header.hub)?,
        lineage: header.lineage,
        sequence: header.sequence,
        fused_at: Timestamp::from_nanos(header.fused_at_ns),
        map_frame: header.map_frame.map(MapFrame::new).transpose()?,
        objects: Vec::new(),
        agents: Vec::new(),
        includes: Vec::new(),
    };
    for _ in 0..n_agents {
        let wire: WireAgent<'_> = take(&mut bytes)?;
        frame.agents.push(AgentHealth {
            agent: AgentId::new(wire.agent)?,
            epoch: wire.epoch,
            newest_captured_at: frame.fused_at - Span::from_nanos(wire.newest_before_fused_ns),
            accepted: wire.accepted,
            refused: wire.refused,
            out_of_sequence: wire.out_of_sequence,
        });
    }
    for _ in 0..n_objects {
        let object = decode_object(&mut bytes, &frame, header.origin_m)?;
        frame.objects.push(object);
    }
    for _ in 0..n_includes {
        let WireInclusion(id, captured, received) = take(&mut bytes)?;
        frame.includes.push(Inclusion {
            frame: frame_id(&id, &frame.agents)?,
            captured_at: frame.fused_at - Span::from_nanos(captured),
            received_at: frame.fused_at - Span::from_nanos(received),
        });
    }
    finish(bytes)?;
    Ok(frame)
}

fn frame_id(wire: &WireFrameId, agents: &[AgentHealth]) -> Result<FrameId, WireError> {
    let health = agents.get(wire.0 as usize).ok_or(WireError::UnlistedAgent)?;
    Ok(FrameId { agent: health.agent, epoch: wire.1 ^ health.epoch, sequence: wire.2 })
}

fn decode_object(
    bytes: &mut &[u8],
    frame: &FusedFrame,
    origin_m: (i32, i32),
) -> Result<FusedObject, WireError> {
    let wire: WireObject = take(bytes)?;
    let contributors_count = checked_count("contributors", wire.contributors, MAX_AGENTS)?;
    let n_classes = checked_count("class probabilities", wire.classes, Class::ALL.len())?;
    let mut class_probabilities = Vec::with_capacity(n_classes);
    for _ in 0..n_classes {
        let (class, probability): (u8, u8) = take(bytes)?;
        let class = Class::from_byte(class).ok_or(WireError::UnknownClass(class))?;
        class_probabilities.push((class, quantity::probability(probability)));
    }
    let mut contributors = Vec::new();
    for _ in 0..contributors_count {
        let (id, index): (WireFrameId, u16) = take(bytes)?;
        contributors.push(MeasurementId { frame: frame_id(&id, &frame.agents)?, index });
    }
    Ok(FusedObject {
        track: TrackId::new(wire.lineage_xor ^ frame.lineage, wire.counter),
        class: class_probabilities.first().map_or(Class::Unknown, |(class, _)| *class),
        class_probabilities,
        bev: BevBox {
            x: absolute(wire.x, origin_m.0),
            y: absolute(wire.y, origin_m.1),
            w: unfixed(wire.w, MILLI),
            d: unfixed(wire.d, MILLI),
            yaw: quantity::yaw(wire.yaw),
        },
        velocity: (unfixed(wire.vx, MILLI), unfixed(wire.vy, MILLI)),
        kinematic_covariance: kinematic::decode(wire.kinematic)?,
        ww: quantity::metric_variance(wire.sw),
        dd: quantity::metric_variance(wire.sd),
        yaw_variance: quantity::yaw_variance(wire.st),
        existence: quantity::probability(wire.existence),
        age: Span::from_nanos(wire.age_ns),
        last_measured_at: frame.fused_at - Span::from_nanos(wire.measured_before_fused_ns),
        contributors,
    })
}
