//! What agents send: objects that move, as sensors report them, in bytes that may be damaged.

use super::dice::Dice;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::id::{AgentId, FrameId, MapFrame};
use v2x_common::sensor::{Accuracy, FieldOfView, SensorDescription, SensorKind};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;

/// An object that drives straight on.
pub(super) struct Object {
    from: [f64; 2],
    velocity: [f64; 2],
    class: Class,
}

impl Object {
    pub(super) fn drawn(dice: &mut Dice) -> Self {
        let [speed, course] = [dice.between(0.0, 15.0), dice.between(-3.0, 3.0)];
        Self {
            from: [dice.between(-60.0, 60.0), dice.between(-60.0, 60.0)],
            velocity: [speed * libm::cos(course), speed * libm::sin(course)],
            class: *dice.of(&[Class::Car, Class::Truck, Class::Adult, Class::Unknown]),
        }
    }

    fn detection(&self, since: Span, sigma_m: f64, dice: &mut Dice) -> Detection {
        let t = since.as_secs_f64();
        let [vx, vy] = self.velocity;
        Detection {
            class: self.class,
            score: dice.between(0.3, 1.0),
            bev: BevBox {
                x: self.from[0] + vx * t + sigma_m * dice.normal(),
                y: self.from[1] + vy * t + sigma_m * dice.normal(),
                w: dice.between(1.6, 2.0),
                d: dice.between(4.0, 5.0),
                yaw: libm::atan2(vy, vx) + 0.05 * dice.normal(),
            },
            covariance: BoxCovariance {
                position: Covariance2::isotropic(sigma_m),
                ww: 0.04,
                dd: 0.1,
                yaw: 0.01,
            },
            velocity: None,
            heading: *dice.of(&[
                HeadingKind::Known,
                HeadingKind::Known,
                HeadingKind::Axis,
                HeadingKind::Unknown,
            ]),
            source_track: None,
        }
    }
}

/// One process of an agent.
pub(super) struct Process {
    pub(super) agent: AgentId,
    pub(super) epoch: u64,
    pub(super) sequence: u64,
    pub(super) clock_offset: Span,
    pub(super) sigma_m: f64,
    pub(super) is_json: bool,
}

/// What crosses the network.
#[derive(Clone)]
pub(super) struct Payload {
    pub(super) bytes: Vec<u8>,
    pub(super) is_json: bool,
}

impl Process {
    /// The frame that it captures at `now`, `since` the beginning.
    pub(super) fn frame(
        &mut self,
        objects: &[Object],
        (now, since): (Timestamp, Span),
        dice: &mut Dice,
    ) -> Payload {
        let seen = objects.iter().filter(|_| dice.happens(0.9)).collect::<Vec<_>>();
        let mut detections: Vec<_> =
            seen.iter().map(|object| object.detection(since, self.sigma_m, dice)).collect();
        if dice.happens(0.05) {
            spoil(&mut detections, dice);
        }
        let mut frame = DetectionFrame {
            id: FrameId { agent: self.agent, epoch: self.epoch, sequence: self.sequence },
            captured_at: now + self.clock_offset,
            sensor_pose: Some(Pose { x: 0.0, y: 0.0, yaw: 0.0 }),
            sensor_revision: 1,
            map_frame: None,
            detections,
        };
        self.sequence += 1;
        if dice.happens(0.02) {
            mislead(&mut frame, dice);
        }
        let mut payload = self.encoded(&frame);
        if dice.happens(0.03) {
            damage(&mut payload.bytes, dice);
        }
        payload
    }

    /// The frame that a sound process sends.
    pub(super) fn right_frame(
        &mut self,
        objects: &[Object],
        (now, since): (Timestamp, Span),
        dice: &mut Dice,
    ) -> Payload {
        let sound = |object: &Object| {
            let mut detection = object.detection(since, self.sigma_m, dice);
            detection.bev.yaw = wrap_angle(detection.bev.yaw);
            detection
        };
        let detections = objects.iter().map(sound).collect();
        let frame = DetectionFrame {
            id: FrameId { agent: self.agent, epoch: self.epoch, sequence: self.sequence },
            captured_at: now,
            sensor_pose: Some(Pose { x: 0.0, y: 0.0, yaw: 0.0 }),
            sensor_revision: 1,
            map_frame: None,
            detections,
        };
        self.sequence += 1;
        let mut bytes = Vec::new();
        let encoded = match self.is_json {
            true => wire::json::encode_detections(&frame).map(|json| bytes = json),
            false => wire::detections::encode(&frame, &mut bytes),
        };
        encoded.unwrap_or_else(|error| panic!("{error}: {frame:?}"));
        Payload { bytes, is_json: self.is_json }
    }

    fn encoded(&self, frame: &DetectionFrame) -> Payload {
        let mut bytes = Vec::new();
        // What cannot be encoded is sent as nobody should send it.
        let is_encoded = if self.is_json {
            wire::json::encode_detections(frame).map(|json| bytes = json).is_ok()
        } else {
            wire::detections::encode(frame, &mut bytes).is_ok()
        };
        if !is_encoded {
            bytes = br#"{"captured_at": 1e300, "detections": [{"x": 1e308, "y": -1e308, "w": -1}]}"#.to_vec();
        }
        Payload { bytes, is_json: self.is_json || !is_encoded }
    }

    pub(super) fn description(&self, dice: &mut Dice) -> Payload {
        let description = described(dice);
        let mut bytes = Vec::new();
        wire::sensor::encode(&description, &mut bytes).expect("a legal description");
        if dice.happens(0.2) {
            damage(&mut bytes, dice);
        }
        Payload { bytes, is_json: false }
    }

    /// A sound one, in its codec.
    pub(super) fn any_description(&self, dice: &mut Dice) -> Payload {
        let (description, mut bytes) = (described(dice), Vec::new());
        if self.is_json {
            bytes = wire::json::encode_sensor(&description).expect("a legal description");
        } else {
            wire::sensor::encode(&description, &mut bytes).expect("a legal description");
        }
        Payload { bytes, is_json: self.is_json }
    }
}

fn described(dice: &mut Dice) -> SensorDescription {
    SensorDescription {
        revision: 1,
        kind: *dice.of(&[SensorKind::RoadsideUnit, SensorKind::Vehicle]),
        field_of_view: FieldOfView::omnidirectional(0.0, dice.between(20.0, 200.0)),
        detection_probability: dice.between(0.5, 0.99),
        clutter_per_m2: dice.between(0.0, 1e-3),
        size_noise: None,
        body: None,
        accuracy: Accuracy { position_m: dice.between(0.01, 1.0), yaw_rad: 0.01, clock_s: 0.01 },
        rate_hz: 10.0,
    }
}

/// Detections as no sensor reports them, which the wire can carry.
fn spoil(detections: &mut Vec<Detection>, dice: &mut Dice) {
    match dice.below(5) {
        // The same one many times.
        0 => {
            let Some(first) = detections.first().cloned() else { return };
            detections.extend(std::iter::repeat_n(first, dice.below(200)));
        }
        1 => detections.iter_mut().for_each(|z| z.covariance.position = Covariance2::isotropic(80.0)),
        2 => detections.iter_mut().for_each(|z| z.covariance.position = Covariance2::isotropic(0.002)),
        3 => detections.iter_mut().for_each(|z| z.bev.x = 9e5),
        _ => detections.iter_mut().for_each(|z| z.bev.w = 1e9),
    }
}

/// A head that says something else than is so.
fn mislead(frame: &mut DetectionFrame, dice: &mut Dice) {
    match dice.below(6) {
        0 => frame.captured_at = Timestamp::EPOCH,
        1 => frame.captured_at += Span::from_millis(3_600_000),
        2 => frame.id.sequence = u64::MAX - u64::from(dice.happens(0.5)),
        3 => frame.id.agent = AgentId::new("somebody-else").expect("a legal name"),
        4 => frame.map_frame = MapFrame::new("elsewhere").ok(),
        _ => frame.sensor_pose = Some(Pose { x: 1e7, y: 0.0, yaw: 40.0 }),
    }
}

fn damage(bytes: &mut Vec<u8>, dice: &mut Dice) {
    if dice.happens(0.4) {
        bytes.truncate(dice.below(bytes.len() + 1));
    }
    for _ in 0..dice.below(4) {
        let Some(last) = bytes.len().checked_sub(1) else { return };
        bytes[dice.below(last + 1)] ^= 1 << dice.below(8);
    }
    if dice.happens(0.2) {
        bytes.extend(std::iter::repeat_with(|| (dice.number() & 0xff) as u8).take(300));
    }
}
