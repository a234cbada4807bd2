//! JSON payloads keep every number, times to the microsecond, and ids of 64 bits.

use crate::{fixture, strategy};
use proptest::prelude::*;
use serde_json::{Value, json};
use v2x_common::class::Class;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::AgentId;
use v2x_common::lists::{DeltaFrame, ListUpdate};
use v2x_common::time::Timestamp;
use v2x_common::wire::json::{self, ReportDefaults};
use v2x_common::wire::{self, ENCODING_JSON, WireError, fused};

/// Parsing, roots and squares each round once or twice.
const TOLERANCE: f64 = 1e-12;

fn decoded(text: &[u8]) -> DetectionFrame {
    let sender = AgentId::new("the-key-says").unwrap();
    json::decode_detections(text, sender, &ReportDefaults::default()).unwrap().frame
}

/// Equal texts, except that numbers may differ by rounding.
#[track_caller]
pub(crate) fn assert_near(got: &[u8], expected: &[u8]) {
    let [got, expected] = [got, expected].map(|text| serde_json::from_slice::<Value>(text).unwrap());
    if let Some(difference) = difference(&got, &expected, "") {
        panic!("{difference}");
    }
}

fn difference(got: &Value, expected: &Value, path: &str) -> Option<String> {
    match (got, expected) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.iter().find_map(|(key, value)| difference(value, &b[key], &format!("{path}/{key}")))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let pairs = a.iter().zip(b).enumerate();
            pairs.into_iter().find_map(|(i, (a, b))| difference(a, b, &format!("{path}/{i}")))
        }
        (Value::Number(a), Value::Number(b)) if a.is_f64() && b.is_f64() => {
            let (a, b) = (a.as_f64()?, b.as_f64()?);
            let near = (a - b).abs() <= TOLERANCE * b.abs().max(1.0);
            (!near).then(|| format!("{path}: {a} is not {b}"))
        }
        (a, b) => (a != b).then(|| format!("{path}: {a} is not {b}")),
    }
}

fn cut(at: Timestamp) -> Timestamp {
    Timestamp::from_micros(at.as_micros()).unwrap()
}

proptest! {
    #[test]
    fn a_detection_frame_survives_json(frame in strategy::detection_frame()) {
        let text = json::encode_detections(&frame).unwrap();
        let got = decoded(&text);
        prop_assert_eq!((got.id, got.captured_at), (frame.id, cut(frame.captured_at)));
        prop_assert_eq!(got.detections.len(), frame.detections.len());
        for (got, sent) in got.detections.iter().zip(&frame.detections) {
            prop_assert_eq!((got.class, got.source_track), (sent.class, sent.source_track));
            let (got_cov, sent_cov) = (got.covariance, sent.covariance);
            for (a, b) in [
                (got.bev.x, sent.bev.x),
                (got.bev.d, sent.bev.d),
                (got_cov.position.xx, sent_cov.position.xx),
                (got_cov.position.xy, sent_cov.position.xy),
                (got_cov.ww, sent_cov.ww),
                (got_cov.yaw, sent_cov.yaw),
            ] {
                prop_assert!((a - b).abs() <= TOLERANCE * b.abs().max(1.0), "{a} is not {b}");
            }
        }
        assert_near(&json::encode_detections(&got).unwrap(), &text);
    }

    #[test]
    fn a_sensor_description_survives_json(description in strategy::sensor_description()) {
        let text = json::encode_sensor(&description).unwrap();
        let got = json::decode_sensor(&text).unwrap();
        prop_assert_eq!((got.kind, got.revision), (description.kind, description.revision));
        assert_near(&json::encode_sensor(&got).unwrap(), &text);
    }

    #[test]
    fn a_delta_frame_survives_json(frame in strategy::delta_frame()) {
        let text = json::encode_delta(&frame).unwrap();
        let got = json::decode_delta(&text).unwrap();
        prop_assert_eq!((got.sequence, got.key_sequence), (frame.sequence, frame.key_sequence));
        prop_assert_eq!((got.fused_at, &got.gone), (cut(frame.fused_at), &frame.gone));
        prop_assert_eq!(got.changed.len(), frame.changed.len());
        assert_near(&json::encode_delta(&got).unwrap(), &text);
    }

    #[test]
    fn a_fused_frame_survives_json(frame in strategy::fused_frame()) {
        let text = json::encode_fused(&frame).unwrap();
        let got = json::decode_fused(&text).unwrap();
        prop_assert_eq!((got.sequence, got.fused_at), (frame.sequence, cut(frame.fused_at)));
        for (got, sent) in got.objects.iter().zip(&frame.objects) {
            prop_assert_eq!((got.track, &got.contributors), (sent.track, &sent.contributors));
            prop_assert_eq!(got.last_measured_at, cut(sent.last_measured_at));
            for (a, b) in [(got.ww, sent.ww), (got.bev.y, sent.bev.y), (got.velocity.0, sent.velocity.0)] {
                prop_assert!((a - b).abs() <= TOLERANCE * b.abs().max(1.0), "{a} is not {b}");
            }
        }
        assert_near(&json::encode_fused(&got).unwrap(), &text);
    }
}

/// A frame with every field, those included that JSON leaves out where they say nothing.
pub(crate) fn complete_delta_frame() -> DeltaFrame {
    let mut frame = fixture::delta_frame();
    frame.changed.iter_mut().for_each(|object| object.class_conflict = 0.5);
    frame
}

#[test]
fn a_message_of_a_list_by_what_changes_is_read_as_what_it_is() {
    let (key, delta) = (fixture::fused_frame(), fixture::delta_frame());
    let (key_text, delta_text) = (json::encode_fused(&key).unwrap(), json::encode_delta(&delta).unwrap());
    let (mut key_bytes, mut delta_bytes) = (Vec::new(), Vec::new());
    fused::encode(&key, &mut key_bytes).unwrap();
    wire::delta::encode(&delta, &mut delta_bytes).unwrap();
    assert_eq!(wire::decode_update("", &key_bytes), Ok(ListUpdate::Key(key)));
    assert_eq!(wire::decode_update("", &delta_bytes), Ok(ListUpdate::Delta(delta)));
    assert!(matches!(wire::decode_update(ENCODING_JSON, &key_text), Ok(ListUpdate::Key(_))));
    assert!(matches!(wire::decode_update("", &delta_text), Ok(ListUpdate::Delta(_))));
}

#[test]
fn an_object_of_a_delta_frame_names_no_contributors() {
    let mut frame = fixture::delta_frame();
    frame.changed[1].contributors = fixture::fused_frame().objects[1].contributors.clone();
    let mut bytes = vec![7];
    assert_eq!(wire::delta::encode(&frame, &mut bytes), Err(WireError::UnlistedAgent));
    assert_eq!(bytes, [7], "the buffer is as it was");
    assert_eq!(json::encode_delta(&frame), Err(WireError::UnlistedAgent));
    let mut text = value(&json::encode_delta(&fixture::delta_frame()).unwrap());
    text["changed"][0]["contributors"] = json!([{ "agent": "ego", "epoch": 1, "sequence": 2, "index": 3 }]);
    assert_eq!(json::decode_delta(text.to_string().as_bytes()), Err(WireError::UnlistedAgent));
}

#[test]
fn an_absurd_number_of_a_changed_object_is_refused_by_name_and_object() {
    let mut text = value(&json::encode_delta(&fixture::delta_frame()).unwrap());
    text["changed"][1]["w"] = json!(-0.1);
    let message = json::decode_delta(text.to_string().as_bytes()).unwrap_err().to_string();
    assert!(message.starts_with("w of object 1 is -0.1"), "{message}");
}

/// A frame with every field, those included that JSON leaves out where they say nothing.
pub(crate) fn complete_fused_frame() -> FusedFrame {
    let mut frame = fixture::fused_frame();
    frame.objects.iter_mut().for_each(|object| object.class_conflict = 0.5);
    frame
}

/// What arrives by postcard and what arrives by JSON.
fn by_both_codecs(frame: &FusedFrame) -> [FusedFrame; 2] {
    let mut bytes = Vec::new();
    fused::encode(frame, &mut bytes).unwrap();
    let text = json::encode_fused(frame).unwrap();
    [fused::decode(&bytes).unwrap(), json::decode_fused(&text).unwrap()]
}

#[test]
fn the_class_of_an_object_is_kept_whatever_its_probabilities_say() {
    let cases = [
        (vec![], vec![(Class::Car, 1.0)]),
        (vec![(Class::Truck, 1.0)], vec![(Class::Car, 0.0), (Class::Truck, 1.0)]),
        (vec![(Class::Truck, 0.6), (Class::Car, 0.4)], vec![(Class::Car, 0.4), (Class::Truck, 0.6)]),
        (vec![(Class::Car, 0.8), (Class::Truck, 0.2)], vec![(Class::Car, 0.8), (Class::Truck, 0.2)]),
    ];
    for (given, expected) in cases {
        let mut frame = fixture::fused_frame();
        frame.objects[0].class = Class::Car;
        frame.objects[0].class_probabilities = given;
        for decoded in by_both_codecs(&frame) {
            assert_eq!(decoded.objects[0].class, Class::Car);
            assert_eq!(decoded.objects[0].class_probabilities, expected);
        }
    }
}

#[test]
fn a_json_object_without_class_probabilities_has_its_class_with_probability_1() {
    let mut text = value(&json::encode_fused(&fixture::fused_frame()).unwrap());
    text["objects"][0]["class_probabilities"] = json!([]);
    let object = &json::decode_fused(text.to_string().as_bytes()).unwrap().objects[0];
    assert_eq!(
        (object.class, &object.class_probabilities[..]),
        (Class::RigidBus, &[(Class::RigidBus, 1.0)][..])
    );
}

#[test]
fn a_fused_number_outside_of_its_limits_is_refused_by_name_and_object() {
    let cases = [
        ("x", json!(2e8), "x"),
        ("y", json!(-2e8), "y"),
        ("w", json!(-0.1), "w"),
        ("d", json!(65.6), "d"),
        ("existence", json!(1.1), "existence"),
        ("class_conflict", json!(1.1), "class conflict"),
        ("sigma/w", json!(-1.0), "sigma.w"),
        ("sigma/x", json!(-1.0), "sigma.x"),
        ("sigma/yaw", json!(1e200), "sigma.yaw"),
        ("kinematic_covariance/0", json!(-1.0), "variance of x"),
        ("kinematic_covariance/6", json!(1e6), "covariance of y and vy"),
        ("class_probabilities/0/1", json!(-0.5), "class probability"),
    ];
    let full = value(&json::encode_fused(&complete_fused_frame()).unwrap());
    let last = full["objects"].as_array().unwrap().len() - 1;
    for (field, absurd, named) in cases {
        let mut text = full.clone();
        *text.pointer_mut(&format!("/objects/{last}/{field}")).unwrap() = absurd;
        let error = json::decode_fused(text.to_string().as_bytes()).unwrap_err();
        assert_eq!(error.reason(), "absurd_value");
        let message = error.to_string();
        assert!(message.starts_with(&format!("{named} of object {last} is ")), "{message:?} for {field}");
    }
}

#[test]
fn a_number_that_is_not_finite_is_no_json() {
    let text = String::from_utf8(json::encode_fused(&fixture::fused_frame()).unwrap()).unwrap();
    for absurd in ["NaN", "1e999", "null"] {
        let text = text.replacen("\"vx\":", &format!("\"vx\":{absurd},\"was\":"), 1);
        assert_eq!(json::decode_fused(text.as_bytes()).unwrap_err().reason(), "bad_json");
    }
}

#[test]
fn a_fused_list_longer_than_a_frame_can_be_is_refused_by_name() {
    let full = value(&json::encode_fused(&fixture::fused_frame()).unwrap());
    for (list, limit) in [("objects", 65_536), ("agents", 4096), ("includes", 65_536)] {
        let mut text = full.clone();
        let item = text[list][0].clone();
        text[list] = vec![item; limit + 1].into();
        let message = json::decode_fused(text.to_string().as_bytes()).unwrap_err().to_string();
        assert!(message.contains(list), "{message:?} should name {list}");
    }
}

#[test]
fn a_delta_longer_than_a_list_can_be_is_refused_by_name() {
    let full = value(&json::encode_delta(&fixture::delta_frame()).unwrap());
    for (list, named) in [("changed", "changed objects"), ("gone", "tracks that are gone")] {
        let mut text = full.clone();
        text[list] = vec![text[list][0].clone(); 65_537].into();
        let message = json::decode_delta(text.to_string().as_bytes()).unwrap_err().to_string();
        assert!(message.contains(named), "{message:?} should name {named}");
    }
}

fn value(text: &[u8]) -> Value {
    serde_json::from_slice(text).unwrap()
}

#[test]
fn ids_beyond_53_bits_are_strings_and_survive() {
    let mut frame = fixture::detection_frame();
    frame.id.epoch = (1 << 53) + 1;
    frame.id.sequence = u64::MAX;
    let text = json::encode_detections(&frame).unwrap();
    assert_eq!(decoded(&text).id, frame.id);
    assert_eq!(decoded(&text).detections[1].source_track, Some(u64::MAX));
    let text = value(&text);
    assert_eq!(text["epoch"], json!("9007199254740993"));
    assert_eq!(text["sequence"], json!("18446744073709551615"));
    let fused = value(&json::encode_fused(&fixture::fused_frame()).unwrap());
    assert_eq!(fused["objects"][0]["track"], json!(0xdead_beee_0000_0011_u64.to_string()));
}

#[test]
fn small_ids_can_be_json_numbers() {
    let text = br#"{"captured_at": 1, "epoch": 5, "sequence": 7, "detections": []}"#;
    let id = decoded(text).id;
    assert_eq!((id.epoch, id.sequence), (5, 7));
}

#[test]
fn times_are_whole_microseconds_rounded_down() {
    let text = value(&json::encode_detections(&fixture::detection_frame()).unwrap());
    assert_eq!(text["captured_at"], json!(1_789_998_400_123_456_i64));
    let fused = value(&json::encode_fused(&fixture::fused_frame()).unwrap());
    assert_eq!(fused["fused_at"], json!(1_789_998_400_165_456_i64));
    assert_eq!(fused["objects"][0]["age_us"], json!(3_600_000_000_i64));
}

#[test]
fn a_heading_of_more_than_half_a_turn_is_taken_as_its_direction() {
    let text = br#"{"captured_at": 1, "detections": [{"class": "car", "x": 0, "y": 0, "yaw": 3.5}]}"#;
    let yaw = decoded(text).detections[0].bev.yaw;
    assert!((yaw - (3.5 - std::f64::consts::TAU)).abs() < 1e-12, "{yaw}");
}

#[test]
fn a_frame_that_names_another_agent_than_the_key_is_returned_as_it_is() {
    let text = br#"{"captured_at": 1, "agent": "mallory", "detections": []}"#;
    assert_eq!(decoded(text).id.agent.as_str(), "mallory");
}
