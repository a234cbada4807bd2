//! Recorded frames with the stamps of today. Pure.

use serde_json::Value;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::keys::Topic;
use v2x_common::recording::Entry;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;

/// Moves times from those of a recording to those of its replay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
    /// A time of the recording, and when it is replayed.
    pub(super) recorded: Timestamp,
    pub(super) replayed: Timestamp,
    /// How many times as fast.
    pub(super) speed: f64,
}

impl Shift {
    /// When something of this time is replayed.
    pub(super) fn time(&self, recorded: Timestamp) -> Timestamp {
        let after = recorded - self.recorded;
        if self.speed.to_bits() == 1.0_f64.to_bits() {
            // Exact: spacing is kept to the nanosecond.
            return self.replayed + after;
        }
        self.replayed + Span::from_secs_f64(after.as_secs_f64() / self.speed)
    }

    /// A boot epoch of the replay: greater than those of the recording and of earlier replays.
    fn epoch(&self, recorded: u64) -> u64 {
        let later = (self.replayed - self.recorded).as_nanos() / 1000;
        recorded.saturating_add(u64::try_from(later).unwrap_or(0))
    }

    /// The payload with the stamps of the replay. What cannot be read stays as it is: a hub is to refuse it again.
    pub(super) fn payload(&self, entry: &Entry) -> Vec<u8> {
        let is_json = wire::is_json(&entry.encoding, &entry.payload);
        let shifted = match Topic::of(&entry.key) {
            Some(Topic::Detections(_)) if is_json => self.json(&entry.payload),
            Some(Topic::Detections(_)) => self.postcard(&entry.payload),
            Some(Topic::Truth(_)) => self.json(&entry.payload),
            _ => None,
        };
        shifted.unwrap_or_else(|| entry.payload.clone())
    }

    fn postcard(&self, payload: &[u8]) -> Option<Vec<u8>> {
        let mut frame = wire::detections::decode(payload).ok()?;
        let DetectionFrame { id, captured_at, detections, .. } = &mut frame;
        id.epoch = self.epoch(id.epoch);
        *captured_at = self.time(*captured_at);
        detections.iter_mut().for_each(|detection| self.hasten(detection));
        let mut shifted = Vec::with_capacity(payload.len());
        wire::detections::encode(&frame, &mut shifted).ok()?;
        Some(shifted)
    }

    /// Objects move as many times as fast.
    fn hasten(&self, detection: &mut Detection) {
        if let Some(velocity) = &mut detection.velocity {
            velocity.x *= self.speed;
            velocity.y *= self.speed;
            let covariance = &mut velocity.covariance;
            for entry in [&mut covariance.xx, &mut covariance.xy, &mut covariance.yy] {
                *entry *= self.speed * self.speed;
            }
        }
    }

    /// Of a frame or of truth as JSON.
    fn json(&self, payload: &[u8]) -> Option<Vec<u8>> {
        let mut value: Value = serde_json::from_slice(payload).ok()?;
        let fields = value.as_object_mut()?;
        if let Some(captured_at) = fields.get_mut("captured_at") {
            let recorded = captured_at.as_i64().and_then(Timestamp::from_micros)?;
            *captured_at = self.time(recorded).as_micros().into();
        }
        if let Some(epoch) = fields.get_mut("epoch") {
            *epoch = self.epoch(epoch.as_u64()?).into();
        }
        serde_json::to_vec(&value).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::covariance::{BoxCovariance, Covariance2, Velocity};
    use v2x_common::geometry::BevBox;
    use v2x_common::id::{AgentId, FrameId, NetworkId};
    use v2x_common::keys::Keys;
    use v2x_common::{Class, HeadingKind};

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    fn entry(payload: Vec<u8>, encoding: &str) -> Entry {
        let agent = AgentId::new("ego").unwrap();
        let key = Keys::new(NetworkId::new("demo").unwrap()).detections(&agent);
        Entry { received_at: at(120), key, encoding: encoding.into(), payload }
    }

    fn frame() -> DetectionFrame {
        let id = FrameId { agent: AgentId::new("ego").unwrap(), epoch: 5, sequence: 9 };
        let mut frame = DetectionFrame::empty(id, at(100));
        frame.detections.push(Detection {
            class: Class::Car,
            score: 1.0,
            bev: BevBox { x: 1.0, y: 2.0, w: 1.8, d: 4.5, yaw: 0.5 },
            covariance: BoxCovariance {
                position: Covariance2::isotropic(0.3),
                ww: 0.01,
                dd: 0.01,
                yaw: 0.01,
            },
            velocity: Some(Velocity { x: 4.0, y: -2.0, covariance: Covariance2::isotropic(0.5) }),
            heading: HeadingKind::Known,
            source_track: None,
        });
        frame
    }

    #[test]
    fn a_frame_is_the_same_but_for_stamp_and_epoch_and_at_twice_the_speed_for_velocity() {
        let mut payload = Vec::new();
        wire::detections::encode(&frame(), &mut payload).unwrap();
        let recorded = wire::detections::decode(&payload).unwrap();
        let entry = entry(payload, wire::ENCODING_POSTCARD);
        let shift = Shift { recorded: at(100), replayed: at(5100), speed: 1.0 };
        let replayed = wire::detections::decode(&shift.payload(&entry)).unwrap();
        assert_eq!((replayed.captured_at, replayed.id.epoch), (at(5100), 5 + 5_000_000));
        assert_eq!(replayed.detections, recorded.detections);
        let shift = Shift { recorded: at(0), replayed: at(5000), speed: 2.0 };
        let replayed = wire::detections::decode(&shift.payload(&entry)).unwrap();
        assert_eq!(replayed.captured_at, at(5050));
        assert!((replayed.detections[0].velocity.unwrap().x - 8.0).abs() < 0.01);
    }

    #[test]
    fn a_frame_as_json_keeps_all_that_it_says_beside_the_stamp() {
        let json = br#"{"captured_at":100000,"epoch":5,"sequence":1,"detections":[{"class":"x","x":1,"y":2}],"more":[1]}"#;
        let shift = Shift { recorded: at(100), replayed: at(5100), speed: 1.0 };
        let replayed = shift.payload(&entry(json.to_vec(), wire::ENCODING_JSON));
        let replayed: Value = serde_json::from_slice(&replayed).unwrap();
        let mut expected: Value = serde_json::from_slice(json).unwrap();
        expected["captured_at"] = 5_100_000.into();
        expected["epoch"] = (5 + 5_000_000).into();
        assert_eq!(replayed, expected);
    }

    #[test]
    fn what_cannot_be_read_is_sent_as_it_was() {
        let shift = Shift { recorded: at(100), replayed: at(5100), speed: 1.0 };
        for (payload, encoding) in
            [(vec![1, 2, 3], wire::ENCODING_POSTCARD), (vec![b'{'], wire::ENCODING_JSON)]
        {
            assert_eq!(shift.payload(&entry(payload.clone(), encoding)), payload);
        }
    }
}
