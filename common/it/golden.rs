//! Version 1 stays readable. Written by `cargo run -p v2x-common --no-default-features --example golden`.

use crate::fixture;
use crate::json_twin::assert_near;
use v2x_common::id::AgentId;
use v2x_common::wire::json::{self, ReportDefaults};
use v2x_common::wire::{delta, detections, fused, sensor};

const DETECTIONS: &[u8] = include_bytes!("golden/v1/detections.bin");
const DETECTIONS_JSON: &str = include_str!("golden/v1/detections.json");
const SENSOR: &[u8] = include_bytes!("golden/v1/sensor.bin");
const SENSOR_JSON: &str = include_str!("golden/v1/sensor.json");
const FUSED: &[u8] = include_bytes!("golden/v1/fused.bin");
const FUSED_JSON: &str = include_str!("golden/v1/fused.json");
const DELTA: &[u8] = include_bytes!("golden/v1/delta.bin");
const DELTA_JSON: &str = include_str!("golden/v1/delta.json");

fn text(json: Vec<u8>) -> String {
    String::from_utf8(json).unwrap() + "\n"
}

#[test]
fn detections_of_version_1_are_read_exactly_and_written_the_same() {
    let frame = detections::decode(DETECTIONS).unwrap();
    assert_eq!(frame, fixture::detection_frame());
    let mut bytes = Vec::new();
    detections::encode(&frame, &mut bytes).unwrap();
    assert_eq!(bytes, DETECTIONS);
}

#[test]
fn a_sensor_description_of_version_1_is_read_exactly_and_written_the_same() {
    let description = sensor::decode(SENSOR).unwrap();
    assert_eq!(description, fixture::sensor_description());
    let mut bytes = Vec::new();
    sensor::encode(&description, &mut bytes).unwrap();
    assert_eq!(bytes, SENSOR);
}

#[test]
fn a_fused_frame_of_version_1_is_read_exactly_and_written_the_same() {
    let frame = fused::decode(FUSED).unwrap();
    assert_eq!(frame, fixture::fused_frame());
    let mut bytes = Vec::new();
    fused::encode(&frame, &mut bytes).unwrap();
    assert_eq!(bytes, FUSED);
}

#[test]
fn a_delta_frame_of_version_1_is_read_exactly_and_written_the_same() {
    let frame = delta::decode(DELTA).unwrap();
    assert_eq!(frame, fixture::delta_frame());
    let mut bytes = Vec::new();
    delta::encode(&frame, &mut bytes).unwrap();
    assert_eq!(bytes, DELTA);
}

#[test]
fn the_golden_json_is_the_twin_of_the_golden_bytes() {
    assert_eq!(
        text(json::encode_detections(&detections::decode(DETECTIONS).unwrap()).unwrap()),
        DETECTIONS_JSON
    );
    assert_eq!(text(json::encode_sensor(&sensor::decode(SENSOR).unwrap()).unwrap()), SENSOR_JSON);
    assert_eq!(text(json::encode_fused(&fused::decode(FUSED).unwrap()).unwrap()), FUSED_JSON);
    assert_eq!(text(json::encode_delta(&delta::decode(DELTA).unwrap()).unwrap()), DELTA_JSON);
}

#[test]
fn the_golden_json_is_read_and_written_the_same() {
    let sender = AgentId::new("another").unwrap();
    let decoded =
        json::decode_detections(DETECTIONS_JSON.as_bytes(), sender, &ReportDefaults::default()).unwrap();
    assert_eq!(decoded.unmapped_classes.total(), 0);
    assert_near(&json::encode_detections(&decoded.frame).unwrap(), DETECTIONS_JSON.as_bytes());
    let description = json::decode_sensor(SENSOR_JSON.as_bytes()).unwrap();
    assert_near(&json::encode_sensor(&description).unwrap(), SENSOR_JSON.as_bytes());
    let frame = json::decode_fused(FUSED_JSON.as_bytes()).unwrap();
    assert_near(&json::encode_fused(&frame).unwrap(), FUSED_JSON.as_bytes());
    let frame = json::decode_delta(DELTA_JSON.as_bytes()).unwrap();
    assert_near(&json::encode_delta(&frame).unwrap(), DELTA_JSON.as_bytes());
}
