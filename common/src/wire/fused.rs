//! Fused frames as bytes.

use super::quantity::{self, MILLI, YAW_STEP_RAD, fixed, unfixed};
use super::{Kind, VERSION, WireError, checked_count, finish, put, take, take_preamble, wire_count};
use crate::class::Class;
use crate::fused::{
    AgentHealth, FusedFrame, FusedObject, Inclusion, KINEMATIC_DIAGONAL, KINEMATIC_INDEX, KinematicCovariance,
};
use crate::geometry::{BevBox, wrap_angle};
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
    x: i32,
    y: i32,
    vx: i32,
    vy: i32,
    w: u16,
    d: u16,
    yaw: i16,
    kinematic_sigma: [u8; 4],
    kinematic_rho: [i8; 6],
    sw: u8,
    sd: u8,
    st: u8,
    existence: u8,
    age_ns: i64,
    measured_before_fused_ns: i64,
    classes: u8,
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
    let origin = frame.objects.first().map_or((0.0, 0.0), |object| (object.bev.x, object.bev.y));
    let header = Header {
        hub: frame.hub.as_str(),
        lineage: frame.lineage,
        sequence: frame.sequence,
        fused_at_ns: frame.fused_at.as_nanos(),
        map_frame: frame.map_frame.as_ref().map(MapFrame::as_str),
        origin_m: (fixed("x", origin.0, 1.0)?, fixed("y", origin.1, 1.0)?),
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
        put(&WireInclusion(wire_frame_id(&inclusion.frame, &frame.agents)?, captured, received), buffer)?;
    }
    Ok(())
}

fn wire_frame_id(id: &FrameId, agents: &[AgentHealth]) -> Result<WireFrameId, WireError> {
    let place = agents.binary_search_by_key(&id.agent, |health| health.agent);
    let place = place.map_err(|_| WireError::UnlistedAgent)?;
    let index = wire_count("agents", place, MAX_AGENTS)?;
    Ok(WireFrameId(index, id.epoch ^ agents[place].epoch, id.sequence))
}

fn encode_object(
    object: &FusedObject,
    frame: &FusedFrame,
    origin_m: (i32, i32),
    buffer: &mut Vec<u8>,
) -> Result<(), WireError> {
    let FusedObject { bev, kinematic_covariance: covariance, .. } = object;
    let variances = KINEMATIC_DIAGONAL.map(|place| covariance[place]);
    let mut kinematic_sigma = [0; 4];
    for (byte, variance) in kinematic_sigma.iter_mut().zip(variances) {
        *byte = quantity::metric_sigma("kinematic variance", variance)?;
    }
    let mut kinematic_rho = [0; 6];
    let off_diagonal = KINEMATIC_INDEX.iter().zip(covariance).filter(|((row, column), _)| row != column);
    for (byte, ((row, column), value)) in kinematic_rho.iter_mut().zip(off_diagonal) {
        *byte = quantity::correlation_byte(*value, variances[*row], variances[*column]);
    }
    let wire = WireObject {
        lineage_xor: object.track.lineage() ^ frame.lineage,
        counter: object.track.counter(),
        x: fixed("x", bev.x - f64::from(origin_m.0), MILLI)?,
        y: fixed("y", bev.y - f64::from(origin_m.1), MILLI)?,
        vx: fixed("vx", object.velocity.0, MILLI)?,
        vy: fixed("vy", object.velocity.1, MILLI)?,
        w: fixed("w", bev.w, MILLI)?,
        d: fixed("d", bev.d, MILLI)?,
        yaw: fixed("yaw", wrap_angle(bev.yaw), YAW_STEP_RAD)?,
        kinematic_sigma,
        kinematic_rho,
        sw: quantity::metric_sigma("variance of w", object.ww)?,
        sd: quantity::metric_sigma("variance of d", object.dd)?,
        st: quantity::yaw_sigma("variance of yaw", object.yaw_variance)?,
        existence: quantity::probability_byte("existence", object.existence)?,
        age_ns: object.age.as_nanos(),
        measured_before_fused_ns: (frame.fused_at - object.last_measured_at).as_nanos(),
        classes: u8::try_from(object.class_probabilities.len()).unwrap_or(u8::MAX),
        contributors: wire_count("contributors", object.contributors.len(), MAX_AGENTS)?,
    };
    put(&wire, buffer)?;
    for (class, probability) in object.class_probabilities.iter().take(usize::from(wire.classes)) {
        put(&(class.byte(), quantity::probability_byte("class probability", *probability)?), buffer)?;
    }
    for measurement in &object.contributors {
        put(&(wire_frame_id(&measurement.frame, &frame.agents)?, measurement.index), buffer)?;
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
    let mut class_probabilities = Vec::with_capacity(usize::from(wire.classes));
    for _ in 0..wire.classes {
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
            x: f64::from(origin_m.0) + unfixed(wire.x, MILLI),
            y: f64::from(origin_m.1) + unfixed(wire.y, MILLI),
            w: unfixed(wire.w, MILLI),
            d: unfixed(wire.d, MILLI),
            yaw: wrap_angle(unfixed(wire.yaw, YAW_STEP_RAD)),
        },
        velocity: (unfixed(wire.vx, MILLI), unfixed(wire.vy, MILLI)),
        kinematic_covariance: kinematic_covariance(wire.kinematic_sigma, wire.kinematic_rho),
        ww: quantity::metric_variance(wire.sw),
        dd: quantity::metric_variance(wire.sd),
        yaw_variance: quantity::yaw_variance(wire.st),
        existence: quantity::probability(wire.existence),
        age: Span::from_nanos(wire.age_ns),
        last_measured_at: frame.fused_at - Span::from_nanos(wire.measured_before_fused_ns),
        contributors,
    })
}

fn kinematic_covariance(sigma: [u8; 4], rho: [i8; 6]) -> KinematicCovariance {
    let variances = sigma.map(quantity::metric_variance);
    let mut covariance = [0.0; 10];
    let mut correlations = rho.into_iter().map(quantity::correlation);
    for (value, (row, column)) in covariance.iter_mut().zip(KINEMATIC_INDEX) {
        *value = if row == column {
            variances[row]
        } else {
            correlations.next().unwrap_or(0.0) * libm::sqrt(variances[row] * variances[column])
        };
    }
    covariance
}
