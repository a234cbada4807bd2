//! Detection frames as bytes.

use super::quantity::{self, MILLI, fixed, unfixed};
use super::{Kind, VERSION, WireError, checked_count, finish, put, take, take_preamble, wire_count};
use crate::class::Class;
use crate::covariance::{BoxCovariance, Velocity};
use crate::detection::{Detection, DetectionFrame, MAX_COORDINATE_M, MAX_DETECTIONS, MAX_RANGE_M};
use crate::geometry::{BevBox, Pose};
use crate::id::{AgentId, FrameId, MapFrame};
use crate::time::Timestamp;
use serde::{Deserialize, Serialize};

const HAS_POSE: u8 = 1;
const HAS_MAP_FRAME: u8 = 2;
const HAS_VELOCITY: u8 = 1;
const HAS_SOURCE_TRACK: u8 = 2;

#[derive(Serialize, Deserialize)]
struct Header<'a> {
    agent: &'a str,
    epoch: u64,
    sequence: u64,
    captured_at_ns: i64,
    sensor_revision: u32,
    flags: u8,
    count: u32,
}

/// The sensor's pose: mm, mm, 0.1 mrad.
#[derive(Serialize, Deserialize)]
struct WirePose(i64, i64, i16);

/// Position relative to the sensor, or to the map frame's origin where no pose is given, mm; sizes, mm; heading, 0.1 mrad; then one byte each.
#[derive(Serialize, Deserialize)]
struct WireDetection {
    flags: u8,
    class: u8,
    score: u8,
    x: i64,
    y: i64,
    w: u16,
    d: u16,
    yaw: i16,
    position: (u8, u8, i8),
    sw: u8,
    sd: u8,
    st: u8,
}

/// mm/s, mm/s, and the covariance.
#[derive(Serialize, Deserialize)]
struct WireVelocity(i32, i32, (u8, u8, i8));

/// Appends the frame to the buffer, in version [`VERSION`].
pub fn encode(frame: &DetectionFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    frame.validate()?;
    buffer.extend([VERSION, Kind::Detections as u8]);
    let mut flags = 0;
    if frame.sensor_pose.is_some() {
        flags |= HAS_POSE;
    }
    if frame.map_frame.is_some() {
        flags |= HAS_MAP_FRAME;
    }
    let header = Header {
        agent: frame.id.agent.as_str(),
        epoch: frame.id.epoch,
        sequence: frame.id.sequence,
        captured_at_ns: frame.captured_at.as_nanos(),
        sensor_revision: frame.sensor_revision,
        flags,
        count: wire_count("detections", frame.detections.len(), MAX_DETECTIONS)?,
    };
    put(&header, buffer)?;
    let mut origin = Origin::OF_THE_MAP;
    if let Some(pose) = &frame.sensor_pose {
        let wire = wire_pose(pose)?;
        origin = Origin::sensor(&wire);
        put(&wire, buffer)?;
    }
    if let Some(map_frame) = &frame.map_frame {
        put(&map_frame.as_str(), buffer)?;
    }
    frame.detections.iter().try_for_each(|detection| encode_detection(detection, &origin, buffer))
}

/// What positions are relative to, as the receiver will know it, m.
struct Origin {
    x: f64,
    y: f64,
    /// How far from it a position may lie along one axis.
    reach_m: f64,
}

impl Origin {
    const OF_THE_MAP: Self = Self { x: 0.0, y: 0.0, reach_m: MAX_COORDINATE_M };

    fn sensor(&WirePose(x, y, _): &WirePose) -> Self {
        Self { x: quantity::millimetres(x), y: quantity::millimetres(y), reach_m: MAX_RANGE_M }
    }

    /// A position in mm. At the limit it may round to what the receiver would refuse: that is an error here.
    fn steps_to(&self, field: &'static str, value: f64, origin: f64) -> Result<i64, WireError> {
        let steps: i64 = fixed(field, value - origin, MILLI)?;
        if quantity::millimetres(steps).abs() <= self.reach_m {
            Ok(steps)
        } else {
            Err(WireError::NotEncodable { field, value })
        }
    }
}

fn wire_pose(pose: &Pose) -> Result<WirePose, WireError> {
    Ok(WirePose(
        fixed("sensor_pose.x", pose.x, MILLI)?,
        fixed("sensor_pose.y", pose.y, MILLI)?,
        quantity::yaw_steps("sensor_pose.yaw", pose.yaw)?,
    ))
}

fn encode_detection(detection: &Detection, origin: &Origin, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    let Detection { bev, covariance, .. } = detection;
    let mut flags = 0;
    if detection.velocity.is_some() {
        flags |= HAS_VELOCITY;
    }
    if detection.source_track.is_some() {
        flags |= HAS_SOURCE_TRACK;
    }
    let wire = WireDetection {
        flags,
        class: detection.class.byte(),
        score: quantity::probability_byte("score", detection.score)?,
        x: origin.steps_to("x", bev.x, origin.x)?,
        y: origin.steps_to("y", bev.y, origin.y)?,
        w: fixed("w", bev.w, MILLI)?,
        d: fixed("d", bev.d, MILLI)?,
        yaw: quantity::yaw_steps("yaw", bev.yaw)?,
        position: quantity::covariance_bytes("position covariance", &covariance.position)?,
        sw: quantity::metric_sigma("variance of w", covariance.ww)?,
        sd: quantity::metric_sigma("variance of d", covariance.dd)?,
        st: quantity::yaw_sigma("variance of yaw", covariance.yaw)?,
    };
    put(&wire, buffer)?;
    if let Some(velocity) = &detection.velocity {
        let vx = fixed("velocity x", velocity.x, MILLI)?;
        let vy = fixed("velocity y", velocity.y, MILLI)?;
        put(&WireVelocity(vx, vy, quantity::covariance_bytes("velocity", &velocity.covariance)?), buffer)?;
    }
    if let Some(track) = detection.source_track {
        put(&track, buffer)?;
    }
    Ok(())
}

/// The frame of the bytes, validated.
pub fn decode(bytes: &[u8]) -> Result<DetectionFrame, WireError> {
    let mut bytes = bytes;
    take_preamble(&mut bytes, Kind::Detections)?;
    let header: Header<'_> = take(&mut bytes)?;
    if header.flags & !(HAS_POSE | HAS_MAP_FRAME) != 0 {
        return Err(WireError::UnknownFlags(header.flags));
    }
    let count = checked_count("detections", header.count, MAX_DETECTIONS)?;
    let agent = AgentId::new(header.agent)?;
    let mut origin = Origin::OF_THE_MAP;
    let mut sensor_pose = None;
    if header.flags & HAS_POSE != 0 {
        let wire = take(&mut bytes)?;
        origin = Origin::sensor(&wire);
        sensor_pose = Some(Pose { x: origin.x, y: origin.y, yaw: quantity::yaw(wire.2) });
    }
    let mut map_frame = None;
    if header.flags & HAS_MAP_FRAME != 0 {
        map_frame = Some(MapFrame::new(take(&mut bytes)?)?);
    }
    // The count is only claimed yet: reserve no more than the bytes could hold.
    let mut detections = Vec::with_capacity(count.min(bytes.len() / MIN_DETECTION_BYTES + 1));
    for _ in 0..count {
        detections.push(decode_detection(&mut bytes, &origin)?);
    }
    finish(bytes)?;
    let frame = DetectionFrame {
        id: FrameId { agent, epoch: header.epoch, sequence: header.sequence },
        captured_at: Timestamp::from_nanos(header.captured_at_ns),
        sensor_pose,
        sensor_revision: header.sensor_revision,
        map_frame,
        detections,
    };
    frame.validate()?;
    Ok(frame)
}

/// A detection with every integer as short as it gets.
const MIN_DETECTION_BYTES: usize = 14;

fn decode_detection(bytes: &mut &[u8], origin: &Origin) -> Result<Detection, WireError> {
    let wire: WireDetection = take(bytes)?;
    if wire.flags & !(HAS_VELOCITY | HAS_SOURCE_TRACK) != 0 {
        return Err(WireError::UnknownFlags(wire.flags));
    }
    let mut velocity = None;
    if wire.flags & HAS_VELOCITY != 0 {
        let WireVelocity(x, y, covariance) = take(bytes)?;
        let covariance = quantity::covariance(covariance);
        velocity = Some(Velocity { x: unfixed(x, MILLI), y: unfixed(y, MILLI), covariance });
    }
    let source_track = if wire.flags & HAS_SOURCE_TRACK != 0 { Some(take(bytes)?) } else { None };
    Ok(Detection {
        class: Class::from_byte(wire.class).ok_or(WireError::UnknownClass(wire.class))?,
        score: quantity::probability(wire.score),
        bev: BevBox {
            x: origin.x + quantity::millimetres(wire.x),
            y: origin.y + quantity::millimetres(wire.y),
            w: unfixed(wire.w, MILLI),
            d: unfixed(wire.d, MILLI),
            yaw: quantity::yaw(wire.yaw),
        },
        covariance: BoxCovariance {
            position: quantity::covariance(wire.position),
            ww: quantity::metric_variance(wire.sw),
            dd: quantity::metric_variance(wire.sd),
            yaw: quantity::yaw_variance(wire.st),
        },
        velocity,
        source_track,
    })
}
