//! Detection frames as bytes.

use super::error::{VERSION, WireError};
use super::framing::{Kind, checked_count, finish, take_preamble, wire_count};
use super::quantity::{self, MILLI, fixed, milli, unfixed};
use super::varint::{MAX_LEN_16, MAX_LEN_32, MAX_LEN_64, Reader, Writer, append};
use crate::class::Class;
use crate::covariance::{BoxCovariance, Velocity};
use crate::detection::HeadingKind;
use crate::detection::{
    self, Detection, DetectionFrame, MAX_COORDINATE_M, MAX_DETECTIONS, MAX_RANGE_M, MAX_SIZE_M,
    MAX_SPEED_MPS, MIN_SIZE_M,
};
use crate::geometry::{BevBox, Pose};
use crate::id::{AgentId, FrameId, MAX_NAME_LEN, MapFrame};
use crate::time::Timestamp;

const HAS_POSE: u8 = 1;
const HAS_MAP_FRAME: u8 = 2;
const HAS_VELOCITY: u8 = 1;
const HAS_SOURCE_TRACK: u8 = 2;
/// What is known of the heading; neither of the two where it is known.
const HEADING_IS_AXIS: u8 = 4;
const HEADING_IS_UNKNOWN: u8 = 8;

/// Two names with their lengths, the preamble and flags; epoch, sequence, time; revision and count; the pose.
const MAX_HEAD_LEN: usize =
    2 * (MAX_NAME_LEN + 1) + 3 + 3 * MAX_LEN_64 + 2 * MAX_LEN_32 + 2 * MAX_LEN_64 + MAX_LEN_16;
/// Nine single bytes, position and box; velocity and its covariance; the sender's track.
const MAX_DETECTION_LEN: usize = 9 + 2 * MAX_LEN_64 + 3 * MAX_LEN_16 + 2 * MAX_LEN_32 + 3 + MAX_LEN_64;
/// A detection with every integer as short as it gets.
const MIN_DETECTION_LEN: usize = 14;

/// The point that positions are relative to, as the receiver computes it, m.
struct Origin {
    x: f64,
    y: f64,
    /// Largest distance of a position from it along one axis, mm: the limit of validation without its margin for
    /// rounding.
    reach_mm: u64,
}

impl Origin {
    const OF_THE_MAP: Self = Self { x: 0.0, y: 0.0, reach_mm: milli(MAX_COORDINATE_M) };

    fn sensor(x_mm: i64, y_mm: i64) -> Self {
        Self { x: quantity::millimetres(x_mm), y: quantity::millimetres(y_mm), reach_mm: milli(MAX_RANGE_M) }
    }

    /// A position in mm. One at the limit that rounds to a value which the receiver refuses is an error here.
    #[inline]
    fn steps_to(&self, field: &'static str, value: f64, origin: f64) -> Result<i64, WireError> {
        let steps: i64 = fixed(field, value - origin, MILLI)?;
        if self.reaches(steps) { Ok(steps) } else { Err(quantity::not_encodable(field, value)) }
    }

    #[inline]
    fn reaches(&self, steps: i64) -> bool {
        steps.unsigned_abs() <= self.reach_mm
    }
}

/// Appends the frame to the buffer, in version [`VERSION`]; on an error the buffer is as it was.
///
/// Allocates nothing where the buffer's capacity suffices: it makes room for the longest numbers.
pub fn encode(frame: &DetectionFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    frame.validate()?;
    let start = buffer.len();
    write(frame, buffer).inspect_err(|_| buffer.truncate(start))
}

/// Makes room for one detection at a time: most are shorter than the longest.
fn write(frame: &DetectionFrame, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    let origin = append(buffer, MAX_HEAD_LEN, |writer| write_head(frame, writer))?;
    for detection in &frame.detections {
        append(buffer, MAX_DETECTION_LEN, |writer| write_detection(detection, &origin, writer))?;
    }
    Ok(())
}

fn write_head(frame: &DetectionFrame, writer: &mut Writer<'_>) -> Result<Origin, WireError> {
    let count = wire_count("detections", frame.detections.len(), MAX_DETECTIONS)?;
    let flags = (HAS_POSE * u8::from(frame.sensor_pose.is_some()))
        | (HAS_MAP_FRAME * u8::from(frame.map_frame.is_some()));
    writer.bytes([VERSION, Kind::Detections as u8]);
    writer.text(frame.id.agent.as_str());
    writer.u64(frame.id.epoch);
    writer.u64(frame.id.sequence);
    writer.i64(frame.captured_at.as_nanos());
    writer.u32(frame.sensor_revision);
    writer.bytes([flags]);
    writer.u32(count);
    let mut origin = Origin::OF_THE_MAP;
    if let Some(pose) = &frame.sensor_pose {
        let x_mm = fixed("sensor_pose.x", pose.x, MILLI)?;
        let y_mm = fixed("sensor_pose.y", pose.y, MILLI)?;
        writer.i64(x_mm);
        writer.i64(y_mm);
        writer.i16(quantity::yaw_steps("sensor_pose.yaw", pose.yaw)?);
        origin = Origin::sensor(x_mm, y_mm);
    }
    if let Some(map_frame) = &frame.map_frame {
        writer.text(map_frame.as_str());
    }
    Ok(origin)
}

/// Position relative to the origin, sizes: mm; heading: 0.1 mrad; velocity: mm/s; one byte for all else.
#[inline]
fn write_detection(detection: &Detection, origin: &Origin, writer: &mut Writer<'_>) -> Result<(), WireError> {
    let Detection { bev, covariance, .. } = detection;
    let flags = (HAS_VELOCITY * u8::from(detection.velocity.is_some()))
        | (HAS_SOURCE_TRACK * u8::from(detection.source_track.is_some()))
        | heading_flag(detection.heading);
    let score = quantity::probability_byte("score", detection.score)?;
    writer.bytes([flags, detection.class.byte(), score]);
    writer.i64(origin.steps_to("x", bev.x, origin.x)?);
    writer.i64(origin.steps_to("y", bev.y, origin.y)?);
    writer.u16(fixed("w", bev.w, MILLI)?);
    writer.u16(fixed("d", bev.d, MILLI)?);
    writer.i16(quantity::yaw_steps("yaw", bev.yaw)?);
    let [sx, sy, rho] = quantity::covariance_bytes("position covariance", &covariance.position)?;
    let sw = quantity::metric_sigma("variance of w", covariance.ww)?;
    let sd = quantity::metric_sigma("variance of d", covariance.dd)?;
    let st = quantity::yaw_sigma("variance of yaw", covariance.yaw)?;
    writer.bytes([sx, sy, rho, sw, sd, st]);
    if let Some(velocity) = &detection.velocity {
        writer.i32(fixed("velocity x", velocity.x, MILLI)?);
        writer.i32(fixed("velocity y", velocity.y, MILLI)?);
        writer.bytes(quantity::covariance_bytes("velocity", &velocity.covariance)?);
    }
    if let Some(track) = detection.source_track {
        writer.u64(track);
    }
    Ok(())
}

const fn heading_flag(heading: HeadingKind) -> u8 {
    match heading {
        HeadingKind::Known => 0,
        HeadingKind::Axis => HEADING_IS_AXIS,
        HeadingKind::Unknown => HEADING_IS_UNKNOWN,
    }
}

/// A frame without its detections.
struct Head {
    id: FrameId,
    captured_at: Timestamp,
    sensor_pose: Option<Pose>,
    sensor_revision: u32,
    map_frame: Option<MapFrame>,
}

impl Head {
    fn with(self, detections: Vec<Detection>) -> DetectionFrame {
        let Self { id, captured_at, sensor_pose, sensor_revision, map_frame } = self;
        DetectionFrame { id, captured_at, sensor_pose, sensor_revision, map_frame, detections }
    }
}

/// The frame of the bytes, validated.
pub fn decode(bytes: &[u8]) -> Result<DetectionFrame, WireError> {
    let mut detections = Vec::new();
    let head = read(bytes, &mut detections)?;
    Ok(head.with(detections))
}

/// The frame of the bytes, with its detections as they were sent: the frame itself is validated, but a detection can have
/// a value outside of its limits ([`Detection::validate`]). For a receiver that drops single detections.
pub fn decode_as_sent(bytes: &[u8]) -> Result<DetectionFrame, WireError> {
    let mut detections = Vec::new();
    let (head, _) = read_as_sent(bytes, &mut detections)?;
    Ok(head.with(detections))
}

/// Makes `frame` the frame of the bytes, validated; allocates nothing where there is room for the detections.
///
/// On an error the frame has lost its detections and is otherwise as it was.
pub fn decode_into(bytes: &[u8], frame: &mut DetectionFrame) -> Result<(), WireError> {
    frame.detections.clear();
    let head = read(bytes, &mut frame.detections).inspect_err(|_| frame.detections.clear())?;
    frame.id = head.id;
    frame.captured_at = head.captured_at;
    frame.sensor_pose = head.sensor_pose;
    frame.sensor_revision = head.sensor_revision;
    frame.map_frame = head.map_frame;
    Ok(())
}

/// Appends the detections, validated, and returns the other fields.
fn read(bytes: &[u8], detections: &mut Vec<Detection>) -> Result<Head, WireError> {
    let (head, are_plausible) = read_as_sent(bytes, detections)?;
    if !are_plausible {
        detection::validate_all(detections, head.sensor_pose.as_ref())?;
    }
    debug_assert_eq!(detection::validate_all(detections, head.sensor_pose.as_ref()), Ok(()));
    Ok(head)
}

/// Appends the detections as they are, and returns the other fields, and whether the detections are surely valid.
fn read_as_sent(bytes: &[u8], detections: &mut Vec<Detection>) -> Result<(Head, bool), WireError> {
    let mut bytes = bytes;
    take_preamble(&mut bytes, Kind::Detections)?;
    let reader = &mut Reader(bytes);
    let (head, count, origin) = read_head(reader)?;
    // The count is not verified yet: reserve no more than the bytes can contain.
    detections.reserve(count.min(reader.0.len() / MIN_DETECTION_LEN));
    let mut are_plausible = true;
    for _ in 0..count {
        are_plausible &= read_detection(reader, &origin, detections)?;
    }
    finish(reader.0)?;
    detection::validate_pose(head.sensor_pose.as_ref())?;
    Ok((head, are_plausible))
}

fn read_head(reader: &mut Reader<'_>) -> Result<(Head, usize, Origin), WireError> {
    let agent = reader.text()?;
    let (epoch, sequence) = (reader.u64()?, reader.u64()?);
    let captured_at = Timestamp::from_nanos(reader.i64()?);
    let sensor_revision = reader.u32()?;
    let [flags] = reader.bytes()?;
    let count = reader.u32()?;
    if flags & !(HAS_POSE | HAS_MAP_FRAME) != 0 {
        return Err(WireError::UnknownFlags(flags));
    }
    let count = checked_count("detections", count, MAX_DETECTIONS)?;
    let id = FrameId { agent: AgentId::new(agent)?, epoch, sequence };
    let mut origin = Origin::OF_THE_MAP;
    let mut sensor_pose = None;
    if flags & HAS_POSE != 0 {
        let (x_mm, y_mm, yaw) = (reader.i64()?, reader.i64()?, reader.i16()?);
        origin = Origin::sensor(x_mm, y_mm);
        sensor_pose = Some(Pose { x: origin.x, y: origin.y, yaw: quantity::yaw(yaw) });
    }
    let mut map_frame = None;
    if flags & HAS_MAP_FRAME != 0 {
        map_frame = Some(MapFrame::new(reader.text()?)?);
    }
    Ok((Head { id, captured_at, sensor_pose, sensor_revision, map_frame }, count, origin))
}

/// Appends a detection; returns whether its integers alone prove that it is valid. Fields of one byte are always valid.
#[inline]
fn read_detection(
    reader: &mut Reader<'_>,
    origin: &Origin,
    detections: &mut Vec<Detection>,
) -> Result<bool, WireError> {
    let [flags, class, score] = reader.bytes()?;
    let (x, y) = (reader.i64()?, reader.i64()?);
    let (w, d, yaw) = (reader.u16()?, reader.u16()?, reader.i16()?);
    let [sx, sy, rho, sw, sd, st] = reader.bytes()?;
    let heading = match flags & (HEADING_IS_AXIS | HEADING_IS_UNKNOWN) {
        0 => HeadingKind::Known,
        HEADING_IS_AXIS => HeadingKind::Axis,
        HEADING_IS_UNKNOWN => HeadingKind::Unknown,
        _ => return Err(WireError::UnknownFlags(flags)),
    };
    if flags & !(HAS_VELOCITY | HAS_SOURCE_TRACK | HEADING_IS_AXIS | HEADING_IS_UNKNOWN) != 0 {
        return Err(WireError::UnknownFlags(flags));
    }
    let is_size = |size_mm: u16| (milli(MIN_SIZE_M)..=milli(MAX_SIZE_M)).contains(&u64::from(size_mm));
    let mut is_plausible = origin.reaches(x) & origin.reaches(y) & is_size(w) & is_size(d);
    let mut velocity = None;
    if flags & HAS_VELOCITY != 0 {
        let (x, y) = (reader.i32()?, reader.i32()?);
        is_plausible &= u64::from(x.unsigned_abs().max(y.unsigned_abs())) <= milli(MAX_SPEED_MPS);
        let covariance = quantity::covariance(reader.bytes()?);
        velocity = Some(Velocity { x: unfixed(x, MILLI), y: unfixed(y, MILLI), covariance });
    }
    let source_track = if flags & HAS_SOURCE_TRACK != 0 { Some(reader.u64()?) } else { None };
    let Some(class) = Class::from_byte(class) else { return Err(WireError::UnknownClass(class)) };
    let bev = BevBox {
        x: origin.x + quantity::millimetres(x),
        y: origin.y + quantity::millimetres(y),
        w: unfixed(w, MILLI),
        d: unfixed(d, MILLI),
        yaw: quantity::yaw(yaw),
    };
    let covariance = BoxCovariance {
        position: quantity::covariance([sx, sy, rho]),
        ww: quantity::metric_variance(sw),
        dd: quantity::metric_variance(sd),
        yaw: quantity::yaw_variance(st),
    };
    let score = quantity::probability(score);
    detections.push(Detection { class, score, bev, covariance, velocity, heading, source_track });
    Ok(is_plausible)
}
