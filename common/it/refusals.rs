//! What is refused, and under which name it is counted.

use crate::fixture;
use v2x_common::class::Class;
use v2x_common::covariance::Velocity;
use v2x_common::detection::{DetectionFrame, MAX_DETECTIONS};
use v2x_common::fused::FusedFrame;
use v2x_common::geometry::BevBox;
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorDescription;
use v2x_common::wire::json::{self, ReportDefaults};
use v2x_common::wire::{WireError, detections, fused, sensor};

fn detection_bytes() -> Vec<u8> {
    let mut bytes = Vec::new();
    detections::encode(&fixture::detection_frame(), &mut bytes).unwrap();
    bytes
}

fn fused_bytes() -> Vec<u8> {
    let mut bytes = Vec::new();
    fused::encode(&fixture::fused_frame(), &mut bytes).unwrap();
    bytes
}

/// The bytes of an agent `a` without pose: version, kind, name, epoch, sequence, time, revision; then flags,
/// count and the rest.
fn plain_frame(tail: &[u8]) -> Vec<u8> {
    [&[1, b'D', 1, b'a', 0, 0, 0, 0], tail].concat()
}

/// One detection at the origin of the map.
const PLAIN_DETECTION: [u8; 14] = [0, 17, 255, 0, 0, 1, 1, 0, 100, 100, 0, 100, 100, 100];

/// The same with one byte of the detection replaced.
fn plain_detection(place: usize, byte: u8) -> Vec<u8> {
    let mut detection = PLAIN_DETECTION;
    detection[place] = byte;
    plain_frame(&[&[0, 1], detection.as_slice()].concat())
}

#[test]
fn a_frame_of_24_bytes_written_by_hand_is_decoded() {
    let frame = detections::decode(&plain_frame(&[&[0, 1], PLAIN_DETECTION.as_slice()].concat())).unwrap();
    let detection = frame.detections[0];
    assert_eq!((frame.id.agent.as_str(), detection.class, detection.score), ("a", Class::Car, 1.0));
    assert_eq!(detection.bev, BevBox { x: 0.0, y: 0.0, w: 0.001, d: 0.001, yaw: 0.0 });
}

#[test]
fn bad_detection_payloads_are_refused_by_reason() {
    let with = |place: usize, byte: u8| {
        let mut bytes = detection_bytes();
        bytes[place] = byte;
        bytes
    };
    let overlong_varint = [0xff; 11];
    let cases: [(&str, Vec<u8>); 15] = [
        ("truncated", Vec::new()),
        ("truncated", vec![1]),
        ("trailing_bytes", [detection_bytes(), vec![0]].concat()),
        ("unknown_version", with(0, 0)),
        ("unknown_version", with(0, 2)),
        ("wrong_kind", with(1, b'F')),
        ("wrong_kind", fused_bytes()),
        ("unknown_flags", plain_frame(&[4, 0])),
        ("unknown_flags", plain_detection(0, 12)),
        ("unknown_flags", plain_detection(0, 16)),
        ("unknown_class", plain_detection(1, 24)),
        ("absurd_value", plain_detection(5, 0)),
        ("bad_name", [&[1, b'D', 1, b'/', 0, 0, 0, 0], [0, 0].as_slice()].concat()),
        ("bad_name", vec![1, b'D', 0, 0, 0, 0, 0, 0, 0]),
        ("malformed", [&[1, b'D', 1, b'a'], overlong_varint.as_slice()].concat()),
    ];
    for (reason, bytes) in cases {
        assert_eq!(detections::decode(&bytes).unwrap_err().reason(), reason, "{bytes:?}");
    }
}

#[test]
fn an_impossible_detection_leaves_the_frame_readable_as_sent() {
    let frame = detections::decode_as_sent(&plain_detection(5, 0)).unwrap();
    assert_eq!(frame.validate_head(), Ok(()));
    let invalid = frame.detections[0].validate(None).unwrap_err();
    assert_eq!((invalid.field, invalid.value, invalid.cause()), ("w", 0.0, "out of range"));
    assert_eq!(detections::decode_as_sent(&plain_frame(&[4, 0])).unwrap_err().reason(), "unknown_flags");
}

#[test]
fn bad_sensor_payloads_are_refused_by_reason() {
    let mut good = Vec::new();
    sensor::encode(&fixture::sensor_description(), &mut good).unwrap();
    // Version, kind, revision, kind of carrier, then the first f64.
    let mut not_a_number = good.clone();
    not_a_number[4..12].copy_from_slice(&f64::NAN.to_le_bytes());
    let mut unknown_carrier = good.clone();
    unknown_carrier[3] = 2;
    let cases = [
        ("bad_description", not_a_number),
        ("unknown_flags", unknown_carrier),
        ("wrong_kind", detection_bytes()),
        ("trailing_bytes", [good, vec![0]].concat()),
    ];
    for (reason, bytes) in cases {
        assert_eq!(sensor::decode(&bytes).unwrap_err().reason(), reason, "{bytes:?}");
    }
}

/// `u32::MAX` as a varint: a claim of four thousand million items that the payload does not hold.
const FOUR_BILLION: [u8; 5] = [0xff, 0xff, 0xff, 0xff, 0x0f];

/// The reason proves it: a decoder that had started to read would have reported the truncated payload.
#[test]
fn a_flood_of_four_billion_items_that_is_claimed_is_refused_before_anything_is_read_or_reserved() {
    let frame = plain_frame(&[&[0], FOUR_BILLION.as_slice()].concat());
    assert_eq!(detections::decode(&frame).unwrap_err().reason(), "too_many");
    // Hub `h`, lineage, sequence, time, no map frame, origin; then the three counts.
    let head = [1, b'F', 1, b'h', 0, 0, 0, 0, 0, 0];
    for n_before in 0..3 {
        let counts = [vec![0; n_before], FOUR_BILLION.to_vec(), vec![0; 2 - n_before]].concat();
        let frame = [head.as_slice(), &counts].concat();
        assert_eq!(fused::decode(&frame).unwrap_err().reason(), "too_many", "{counts:?}");
    }
}

#[test]
fn a_claimed_length_of_text_beyond_the_payload_is_truncated() {
    let frame = [&[1, b'D'], FOUR_BILLION.as_slice(), b"abc"].concat();
    assert_eq!(detections::decode(&frame).unwrap_err().reason(), "truncated");
}

#[test]
fn too_many_detections_are_refused_in_both_directions() {
    let count = [0x81, 0x20]; // 4097
    let bytes = plain_frame(&[&[0], count.as_slice(), &PLAIN_DETECTION.repeat(MAX_DETECTIONS + 1)].concat());
    assert_eq!(
        detections::decode(&bytes),
        Err(WireError::TooMany { what: "detections", count: 4097, limit: MAX_DETECTIONS })
    );
    let mut frame = fixture::detection_frame();
    frame.detections = vec![frame.detections[0]; MAX_DETECTIONS + 1];
    let message = detections::encode(&frame, &mut Vec::new()).unwrap_err().to_string();
    assert!(message.contains("number of detections is 4097"), "{message}");
    frame.detections.pop();
    assert_eq!(detections::encode(&frame, &mut Vec::new()), Ok(()));
}

#[test]
fn a_detection_frame_with_a_number_that_is_not_finite_or_too_large_cannot_be_encoded() {
    type Spoil = fn(&mut DetectionFrame, f64);
    let spoils: [Spoil; 11] = [
        |frame, value| frame.detections[0].bev.x = value,
        |frame, value| frame.detections[0].bev.w = value,
        |frame, value| frame.detections[0].bev.yaw = value,
        |frame, value| frame.detections[0].score = value,
        |frame, value| frame.detections[0].covariance.position.xx = value,
        |frame, value| frame.detections[0].covariance.position.xy = value,
        |frame, value| frame.detections[0].covariance.dd = value,
        |frame, value| frame.detections[0].covariance.yaw = value,
        |frame, value| frame.detections[0].velocity = Some(Velocity { x: value, ..Velocity::default() }),
        |frame, value| frame.sensor_pose.as_mut().unwrap().y = value,
        |frame, value| {
            frame.sensor_pose = None;
            frame.detections[2].bev.y = value;
        },
    ];
    for (place, spoil) in spoils.into_iter().enumerate() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            let mut frame = fixture::detection_frame();
            spoil(&mut frame, value);
            let refusal = detections::encode(&frame, &mut Vec::new()).unwrap_err();
            assert_eq!(refusal.reason(), "absurd_value", "{place} {value}");
            assert_eq!(
                json::encode_detections(&frame).unwrap_err().reason(),
                "absurd_value",
                "{place} {value}"
            );
        }
    }
}

#[test]
fn a_sensor_description_with_a_number_that_is_not_finite_cannot_be_encoded() {
    type Spoil = fn(&mut SensorDescription);
    let spoils: [Spoil; 3] = [
        |description| description.rate_hz = f64::NAN,
        |description| description.field_of_view.range_max_m = f64::INFINITY,
        |description| description.accuracy.clock_s = f64::INFINITY,
    ];
    for spoil in spoils {
        let mut description = fixture::sensor_description();
        spoil(&mut description);
        assert_eq!(sensor::encode(&description, &mut Vec::new()).unwrap_err().reason(), "bad_description");
        assert_eq!(json::encode_sensor(&description).unwrap_err().reason(), "bad_description");
    }
}

/// JSON would contain `null` for them, which is not a number.
#[test]
fn a_fused_frame_with_a_number_that_is_not_finite_cannot_be_encoded() {
    type Spoil = fn(&mut FusedFrame, f64);
    let spoils: [Spoil; 10] = [
        |frame, value| frame.objects[1].bev.x = value,
        |frame, value| frame.objects[0].class_conflict = value,
        |frame, value| frame.objects[0].bev.y = value,
        |frame, value| frame.objects[1].bev.yaw = value,
        |frame, value| frame.objects[1].velocity.1 = value,
        |frame, value| frame.objects[1].kinematic_covariance[0] = value,
        |frame, value| frame.objects[1].kinematic_covariance[1] = value,
        |frame, value| frame.objects[1].ww = value,
        |frame, value| frame.objects[1].existence = value,
        |frame, value| frame.objects[1].class_probabilities[0].1 = value,
    ];
    for (place, spoil) in spoils.into_iter().enumerate() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut frame = fixture::fused_frame();
            spoil(&mut frame, value);
            let refusal = fused::encode(&frame, &mut Vec::new()).unwrap_err();
            assert_eq!(refusal.reason(), "not_encodable", "{place} {value}");
            assert_eq!(json::encode_fused(&frame).unwrap_err().reason(), "not_encodable", "{place} {value}");
        }
    }
}

#[test]
fn a_fused_frame_with_a_negative_variance_cannot_be_encoded() {
    let mut frame = fixture::fused_frame();
    frame.objects[0].ww = -1.0;
    assert_eq!(fused::encode(&frame, &mut Vec::new()).unwrap_err().reason(), "not_encodable");
    assert_eq!(json::encode_fused(&frame).unwrap_err().reason(), "not_encodable");
}

#[test]
fn a_fused_frame_that_names_an_agent_without_listing_it_is_refused() {
    let mut frame = fixture::fused_frame();
    frame.agents.pop();
    assert_eq!(fused::encode(&frame, &mut Vec::new()), Err(WireError::UnlistedAgent));
}

#[test]
fn a_fused_frame_with_more_classes_than_exist_cannot_be_encoded() {
    let mut frame = fixture::fused_frame();
    let share = frame.objects[0].class_probabilities[0];
    frame.objects[0].class_probabilities = vec![share; 25];
    assert_eq!(fused::encode(&frame, &mut Vec::new()).unwrap_err().reason(), "too_many");
}

/// Six correlations of 1 - 1/128 with mixed signs, at the place where the second object's stand.
#[test]
fn an_indefinite_kinematic_covariance_is_refused() {
    let good = fused_bytes();
    let sigmas = [0, 255, 1, 254, 0, 0, 0, 0, 0, 0];
    let place = 4 + good.windows(10).position(|window| window == sigmas).expect("the fixture holds them");
    let mut bytes = good;
    bytes[place..place + 6].copy_from_slice(&[127i8, -127, 127, 127, -127, 127].map(i8::cast_unsigned));
    assert_eq!(fused::decode(&bytes).unwrap_err().reason(), "absurd_value");
}

#[test]
fn bad_json_is_refused_by_reason() {
    let cases = [
        ("bad_json", ""),
        ("bad_json", "[]"),
        ("bad_json", r#"{"captured_at": 1, "detections": []} x"#),
        ("bad_json", r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1e999, "y": 0}]}"#),
        ("absurd_value", r#"{"captured_at": 1, "detections": [{"class": "car", "x": null, "y": 0}]}"#),
        ("bad_json", r#"{"captured_at": 1, "detections": [{"class": "car", "x": "1", "y": 0}]}"#),
        ("wrong_time_unit", r#"{"captured_at": 9223372036854775807, "detections": []}"#),
        ("bad_json", r#"{"captured_at": 1, "sequence": "-1", "detections": []}"#),
        ("absurd_value", r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1e300, "y": 0}]}"#),
        (
            "absurd_value",
            r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 0, "sigma": {"x": -1}}]}"#,
        ),
        (
            "absurd_value",
            r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 0, "sigma": {"rho": 1}}]}"#,
        ),
    ];
    let sender = AgentId::new("cam").unwrap();
    for (reason, text) in cases {
        let refusal =
            json::decode_detections(text.as_bytes(), sender, &ReportDefaults::default()).unwrap_err();
        assert_eq!(refusal.reason(), reason, "{text}: {refusal}");
    }
}
