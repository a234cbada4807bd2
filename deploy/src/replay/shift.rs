//! Recorded frames with the stamps of today. Pure.

use serde_json::{Map, Number, Value};
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::keys::Topic;
use v2x_common::recording::Entry;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::{self, WireError};

/// Why a payload keeps the stamps of the recording.
#[derive(Debug, thiserror::Error)]
pub(super) enum NotShifted {
    /// It cannot be read, or not be written again.
    #[error(transparent)]
    Wire(#[from] WireError),
    /// A field is missing, or is nothing that can be shifted.
    #[error("{field} is {found}, and not {wanted}")]
    Field {
        /// Its name.
        field: &'static str,
        /// What it is instead.
        found: String,
        /// What it is to be.
        wanted: &'static str,
    },
}

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
        if self.is_as_recorded() {
            // Exact: spacing is kept to the nanosecond.
            return self.replayed + after;
        }
        self.replayed + Span::from_secs_f64(after.as_secs_f64() / self.speed)
    }

    const fn is_as_recorded(&self) -> bool {
        self.speed.to_bits() == 1.0_f64.to_bits()
    }

    /// A boot epoch of the replay: greater than those of the recording and of earlier replays.
    fn epoch(&self, recorded: u64) -> u64 {
        let later = (self.replayed - self.recorded).as_nanos() / 1000;
        recorded.saturating_add(u64::try_from(later).unwrap_or(0))
    }

    /// The payload with the stamps of the replay.
    ///
    /// # Errors
    /// Where it cannot be shifted. Sent as it is, it is refused again, as too late at least.
    pub(super) fn payload(&self, entry: &Entry) -> Result<Vec<u8>, NotShifted> {
        let is_json = wire::is_json(&entry.encoding, &entry.payload);
        match Topic::of(&entry.key) {
            Some(Topic::Detections(_)) if is_json => self.json_frame(&entry.payload),
            Some(Topic::Detections(_)) => self.postcard(&entry.payload),
            Some(Topic::Truth(_)) => self.truth(&entry.payload),
            _ => Ok(entry.payload.clone()),
        }
    }

    fn postcard(&self, payload: &[u8]) -> Result<Vec<u8>, NotShifted> {
        let mut frame = wire::detections::decode(payload)?;
        let DetectionFrame { id, captured_at, detections, .. } = &mut frame;
        id.epoch = self.epoch(id.epoch);
        *captured_at = self.time(*captured_at);
        detections.iter_mut().for_each(|detection| self.hasten(detection));
        let mut shifted = Vec::with_capacity(payload.len());
        wire::detections::encode(&frame, &mut shifted)?;
        Ok(shifted)
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

    /// A frame as JSON: all that it says stays, but for stamp, epoch and velocities.
    fn json_frame(&self, payload: &[u8]) -> Result<Vec<u8>, NotShifted> {
        let mut value = wire::json::decode_value(payload)?;
        let fields = fields_of(&mut value)?;
        let captured_at = fields.get("captured_at").unwrap_or(&Value::Null);
        let recorded = captured_at.as_i64().and_then(Timestamp::from_micros);
        let recorded =
            recorded.ok_or_else(|| wrong("captured_at", captured_at, "whole microseconds since 1970"))?;
        fields.insert("captured_at".into(), self.time(recorded).as_micros().into());
        if fields.contains_key("epoch") {
            self.shift_epoch(fields)?;
        } else if fields.contains_key("sequence") {
            // Without an epoch, numbers of a second time would be those of the first.
            fields.insert("epoch".into(), self.epoch(0).to_string().into());
        }
        let detections = fields.get_mut("detections").and_then(Value::as_array_mut);
        for velocity in detections.into_iter().flatten().filter_map(|one| one.get_mut("velocity")) {
            self.hasten_json(velocity);
        }
        print(&value)
    }

    /// What the detections of a frame truly are, as JSON.
    fn truth(&self, payload: &[u8]) -> Result<Vec<u8>, NotShifted> {
        let mut value = wire::json::decode_value(payload)?;
        self.shift_epoch(fields_of(&mut value)?)?;
        print(&value)
    }

    /// An epoch is a text of digits or a number, and stays what it is.
    fn shift_epoch(&self, fields: &mut Map<String, Value>) -> Result<(), NotShifted> {
        let epoch = fields.get("epoch").unwrap_or(&Value::Null);
        let text = epoch.as_str().and_then(|digits| digits.parse().ok());
        let shifted = match (text, epoch.as_u64()) {
            (Some(recorded), _) => self.epoch(recorded).to_string().into(),
            (None, Some(recorded)) => self.epoch(recorded).into(),
            (None, None) => return Err(wrong("epoch", epoch, "a number of 64 bits")),
        };
        fields.insert("epoch".into(), shifted);
        Ok(())
    }

    /// What is no number stays as it is: a hub is to refuse it again.
    fn hasten_json(&self, velocity: &mut Value) {
        if self.is_as_recorded() {
            return;
        }
        for field in ["x", "y", "sigma_x", "sigma_y"] {
            let Some(of) = velocity.get_mut(field) else { continue };
            if let Some(hastened) = of.as_f64().and_then(|one| Number::from_f64(one * self.speed)) {
                *of = Value::Number(hastened);
            }
        }
    }
}

fn fields_of(value: &mut Value) -> Result<&mut Map<String, Value>, NotShifted> {
    match value {
        Value::Object(fields) => Ok(fields),
        other => Err(wrong("the payload", other, "an object")),
    }
}

/// What is found is cut: a payload can be long.
fn wrong(field: &'static str, found: &Value, wanted: &'static str) -> NotShifted {
    const MOST: usize = 40;
    let found = match found {
        Value::Null => "missing".to_owned(),
        other => other.to_string().chars().take(MOST).collect(),
    };
    NotShifted::Field { field, found, wanted }
}

fn print(value: &Value) -> Result<Vec<u8>, NotShifted> {
    Ok(serde_json::to_vec(value).map_err(|error| WireError::json(&error))?)
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
        let replayed = wire::detections::decode(&shift.payload(&entry).unwrap()).unwrap();
        assert_eq!((replayed.captured_at, replayed.id.epoch), (at(5100), 5 + 5_000_000));
        assert_eq!(replayed.detections, recorded.detections);
        let shift = Shift { recorded: at(0), replayed: at(5000), speed: 2.0 };
        let replayed = wire::detections::decode(&shift.payload(&entry).unwrap()).unwrap();
        assert_eq!(replayed.captured_at, at(5050));
        assert!((replayed.detections[0].velocity.unwrap().x - 8.0).abs() < 0.01);
    }

    /// A frame as JSON after the shift, with what it was.
    fn shifted(shift: Shift, json: &str) -> (Value, Value) {
        let replayed = shift.payload(&entry(json.as_bytes().to_vec(), wire::ENCODING_JSON)).unwrap();
        (serde_json::from_slice(&replayed).unwrap(), serde_json::from_str(json).unwrap())
    }

    const LATER: Shift = Shift {
        recorded: Timestamp::from_nanos(100_000_000),
        replayed: Timestamp::from_nanos(5_100_000_000),
        speed: 1.0,
    };

    #[test]
    fn a_frame_as_json_keeps_all_that_it_says_beside_the_stamp_whether_its_epoch_is_a_text_or_a_number() {
        for (epoch, later) in [(r#""5""#, Value::from("5000005")), ("5", Value::from(5_000_005))] {
            let json = format!(
                r#"{{"captured_at":100000,"epoch":{epoch},"sequence":"1","detections":[{{"class":"x","x":1,"y":2,"velocity":{{"x":1.5,"y":-2,"sigma_x":1,"sigma_y":1}}}}],"more":[1]}}"#
            );
            let (replayed, mut expected) = shifted(LATER, &json);
            expected["captured_at"] = 5_100_000.into();
            expected["epoch"] = later;
            assert_eq!(replayed, expected);
        }
    }

    #[test]
    fn what_our_own_encoder_writes_is_shifted() {
        let json = wire::json::encode_detections(&frame()).unwrap();
        let replayed = LATER.payload(&entry(json, wire::ENCODING_JSON)).unwrap();
        let agent = AgentId::new("ego").unwrap();
        let replayed = wire::json::decode_detections(&replayed, agent, &Default::default()).unwrap().frame;
        assert_eq!((replayed.captured_at, replayed.id.epoch), (at(5100), 5 + 5_000_000));
    }

    #[test]
    fn a_numbered_frame_without_an_epoch_gets_one_that_differs_each_time() {
        let json = r#"{"captured_at":100000,"sequence":7,"detections":[]}"#;
        let again = Shift { replayed: LATER.replayed + Span::from_millis(900), ..LATER };
        let (first, second) = (shifted(LATER, json).0, shifted(again, json).0);
        assert_eq!((&first["epoch"], &second["epoch"]), (&"5000000".into(), &"5900000".into()));
        // Without a number its stamp is its number.
        assert_eq!(shifted(LATER, r#"{"captured_at":100000,"detections":[]}"#).0.get("epoch"), None);
    }

    #[test]
    fn objects_as_json_move_as_many_times_as_fast() {
        let velocity = r#"{"x":4,"y":-2.5,"sigma_x":0.5,"sigma_y":null,"rho":0.1}"#;
        let json = format!(r#"{{"captured_at":100000,"detections":[{{"velocity":{velocity}}},{{}}]}}"#);
        let (replayed, _) = shifted(Shift { speed: 2.0, ..LATER }, &json);
        let expected: Value =
            serde_json::from_str(r#"{"x":8.0,"y":-5.0,"sigma_x":1.0,"sigma_y":null,"rho":0.1}"#).unwrap();
        assert_eq!(replayed["detections"][0]["velocity"], expected);
    }

    #[test]
    fn numbers_that_are_not_finite_as_python_writes_them_stop_no_shift() {
        let json = r#"{"captured_at":100000,"detections":[{"class":"car","x":NaN,"y":2}]}"#;
        let replayed = LATER.payload(&entry(json.into(), wire::ENCODING_JSON)).unwrap();
        let agent = AgentId::new("ego").unwrap();
        let read = wire::json::decode_detections_as_sent(&replayed, agent, &Default::default()).unwrap();
        assert!(read.frame.captured_at == at(5100) && read.frame.detections[0].bev.x.is_nan());
    }

    #[test]
    fn what_cannot_be_shifted_says_why() {
        for (payload, encoding, why) in [
            (&[1, 2, 3][..], wire::ENCODING_POSTCARD, "payload kind"),
            (b"{", wire::ENCODING_JSON, "JSON"),
            (br#"{"detections":[]}"#, wire::ENCODING_JSON, "captured_at is missing"),
            (br#"{"captured_at":1.5,"detections":[]}"#, wire::ENCODING_JSON, "captured_at is 1.5"),
            (br#"{"captured_at":1,"epoch":"x","detections":[]}"#, wire::ENCODING_JSON, "epoch is \"x\""),
        ] {
            let error = LATER.payload(&entry(payload.to_vec(), encoding)).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
    }
}
