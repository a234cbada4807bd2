//! Damaged payloads: every one is an error or a valid frame, never a panic.

use crate::round_trip::is_positive_definite;
use crate::{fixture, strategy};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_common::id::AgentId;
use v2x_common::wire::json::{self, ReportDefaults};
use v2x_common::wire::{VERSION, WireError, delta, detections, fused, sensor};

type Outcome = Result<(), WireError>;

/// Decodes; a frame that comes out must be valid, and stable when encoded again. A frame that was there
/// before becomes the same one, or is left valid.
fn digest_detections(bytes: &[u8]) -> Outcome {
    let mut reused = fixture::detection_frame();
    let outcome = detections::decode_into(bytes, &mut reused);
    reused.validate().unwrap();
    let decoded = detections::decode(bytes);
    assert_eq!(decoded.as_ref().map(drop), outcome.as_ref().map(drop));
    let frame = decoded?;
    assert_eq!(frame, reused);
    check_detections(&frame);
    Ok(())
}

fn check_detections(frame: &DetectionFrame) {
    frame.validate().unwrap();
    let [mut once, mut twice] = [Vec::new(), Vec::new()];
    detections::encode(frame, &mut once).unwrap();
    detections::encode(&detections::decode(&once).unwrap(), &mut twice).unwrap();
    assert_eq!(once, twice);
}

fn digest_sensor(bytes: &[u8]) -> Outcome {
    let description = sensor::decode(bytes)?;
    description.validate().unwrap();
    let mut again = Vec::new();
    sensor::encode(&description, &mut again).unwrap();
    assert_eq!(sensor::decode(&again).unwrap(), description);
    Ok(())
}

fn digest_fused(bytes: &[u8]) -> Outcome {
    let frame = fused::decode(bytes)?;
    check_objects(&frame.objects);
    let [mut once, mut twice] = [Vec::new(), Vec::new()];
    // Damage can leave the agents' names out of order, which only a sender must keep.
    if fused::encode(&frame, &mut once).is_ok() {
        fused::encode(&fused::decode(&once).unwrap(), &mut twice).unwrap();
        assert_eq!(once, twice);
    }
    Ok(())
}

fn digest_delta(bytes: &[u8]) -> Outcome {
    let frame = delta::decode(bytes)?;
    check_objects(&frame.changed);
    let [mut once, mut twice] = [Vec::new(), Vec::new()];
    // Damage can move an object to where no sender can have it.
    if delta::encode(&frame, &mut once).is_ok() {
        delta::encode(&delta::decode(&once).unwrap(), &mut twice).unwrap();
        assert_eq!(once, twice);
    }
    Ok(())
}

fn check_objects(objects: &[FusedObject]) {
    for object in objects {
        let bev = object.bev;
        let numbers = [bev.x, bev.y, bev.w, bev.d, bev.yaw, object.velocity.0, object.velocity.1];
        assert!(numbers.into_iter().all(f64::is_finite), "{object:?}");
        assert!(is_positive_definite(object), "{object:?}");
        assert!(object.ww > 0.0 && object.dd > 0.0 && object.yaw_variance > 0.0);
        assert!((0.0..=1.0).contains(&object.existence));
    }
}

struct Kind {
    letter: u8,
    bytes: Vec<u8>,
    digest: fn(&[u8]) -> Outcome,
}

fn kinds() -> [Kind; 4] {
    let [mut detection_bytes, mut sensor_bytes, mut fused_bytes] = [Vec::new(), Vec::new(), Vec::new()];
    let mut delta_bytes = Vec::new();
    delta::encode(&fixture::delta_frame(), &mut delta_bytes).unwrap();
    detections::encode(&fixture::detection_frame(), &mut detection_bytes).unwrap();
    sensor::encode(&fixture::sensor_description(), &mut sensor_bytes).unwrap();
    fused::encode(&fixture::fused_frame(), &mut fused_bytes).unwrap();
    [
        Kind { letter: b'D', bytes: detection_bytes, digest: digest_detections },
        Kind { letter: b'S', bytes: sensor_bytes, digest: digest_sensor },
        Kind { letter: b'F', bytes: fused_bytes, digest: digest_fused },
        Kind { letter: b'C', bytes: delta_bytes, digest: digest_delta },
    ]
}

fn json_kinds() -> [Kind; 4] {
    fn detections(bytes: &[u8]) -> Outcome {
        let sender = AgentId::new("cam").unwrap();
        let decoded = json::decode_detections(bytes, sender, &ReportDefaults::default())?;
        decoded.frame.validate().unwrap();
        Ok(())
    }
    let sensor: fn(&[u8]) -> Outcome = |bytes| json::decode_sensor(bytes).map(|got| got.validate().unwrap());
    let fused: fn(&[u8]) -> Outcome = |bytes| json::decode_fused(bytes).map(drop);
    let delta: fn(&[u8]) -> Outcome = |bytes| json::decode_delta(bytes).map(drop);
    [
        Kind {
            letter: b'D',
            bytes: json::encode_detections(&fixture::detection_frame()).unwrap(),
            digest: detections,
        },
        Kind {
            letter: b'S',
            bytes: json::encode_sensor(&fixture::sensor_description()).unwrap(),
            digest: sensor,
        },
        Kind { letter: b'F', bytes: json::encode_fused(&fixture::fused_frame()).unwrap(), digest: fused },
        Kind { letter: b'C', bytes: json::encode_delta(&fixture::delta_frame()).unwrap(), digest: delta },
    ]
}

#[test]
fn every_truncation_is_an_error() {
    for Kind { bytes, digest, letter } in kinds().into_iter().chain(json_kinds()) {
        assert_eq!(digest(&bytes), Ok(()));
        for len in 0..bytes.len() {
            assert!(digest(&bytes[..len]).is_err(), "{} cut to {len}", char::from(letter));
        }
    }
}

#[test]
fn truncated_and_overlong_postcard_is_refused_as_such() {
    for Kind { mut bytes, digest, .. } in kinds() {
        for len in 0..bytes.len() {
            assert_eq!(digest(&bytes[..len]).unwrap_err().reason(), "truncated", "cut to {len}");
        }
        bytes.push(0);
        assert_eq!(digest(&bytes).unwrap_err().reason(), "trailing_bytes");
    }
}

/// Every single bit flip, and every other damage to one byte.
#[test]
fn every_fault_of_one_byte_is_an_error_or_a_valid_frame() {
    for Kind { mut bytes, digest, .. } in kinds() {
        let mut survivors = 0;
        for place in 0..bytes.len() {
            let original = bytes[place];
            for damage in 1..=u8::MAX {
                bytes[place] = original ^ damage;
                survivors += usize::from(digest(&bytes).is_ok());
            }
            bytes[place] = original;
        }
        assert!(survivors > bytes.len(), "most bytes hold numbers, of which others are legal too");
    }
}

#[test]
fn a_flood_of_text_is_cut_between_where_the_field_is_named_and_where_its_place_is_said() {
    let name = serde_json::to_string(&"ä\u{1b}".repeat(100_000)).unwrap();
    let payload = format!("{{\"captured_at\":1,{name}:1}}");
    let words =
        json::decode_detections(payload.as_bytes(), AgentId::new("cam").unwrap(), &ReportDefaults::default());
    let words = words.unwrap_err().to_string();
    assert!(words.starts_with("JSON: unknown field `ä\u{fffd}ä") && words.contains('…'), "{words}");
    assert!(words.contains(" at line 1 column ") && !words.contains('\u{1b}'), "{words}");
}

#[test]
fn every_fault_of_one_bit_in_json_is_an_error_or_a_valid_frame() {
    for Kind { mut bytes, digest, .. } in json_kinds() {
        for place in 0..bytes.len() {
            for bit in 0..8 {
                bytes[place] ^= 1 << bit;
                // Either outcome is right; the digest itself checks that what is accepted is valid.
                let _outcome = digest(&bytes);
                bytes[place] ^= 1 << bit;
            }
        }
    }
}

/// The payload with a text in the place of one of its names, texts or numbers.
fn with_text(json: &str, place: Index, text: &str) -> String {
    let quoted = serde_json::to_string(text).unwrap();
    let mut parts: Vec<_> = json.split_inclusive(['"', ':', ',', '{', '}', '[', ']']).collect();
    let is_value = |part: &str| part.starts_with(|c: char| c.is_alphanumeric() || c == '-');
    let values: Vec<_> = (0..parts.len()).filter(|k| is_value(parts[*k])).collect();
    let k = values[place.index(values.len())];
    let (value, end) = parts[k].split_at(parts[k].len() - 1);
    let text = if end == "\"" { &quoted[1..quoted.len() - 1] } else { &quoted[..] };
    let replaced = format!("{text}{end}");
    assert!(!value.is_empty());
    parts[k] = &replaced;
    parts.concat()
}

/// Bytes of a refusal in words, at most.
const WORDS: usize = 512;

proptest! {
    #[test]
    fn a_flood_of_text_anywhere_in_a_payload_is_refused_in_few_words(
        text in vec(any::<char>(), 1..12), repeats in 1_usize..1000, place in any::<Index>()
    ) {
        let text = text.into_iter().collect::<String>().repeat(repeats);
        for Kind { bytes, digest, .. } in json_kinds() {
            let json = String::from_utf8(bytes).unwrap();
            let quoted = serde_json::to_string(&text).unwrap();
            for payload in [with_text(&json, place, &text), text.clone(), quoted, format!("{{{text}")] {
                let words = digest(payload.as_bytes()).err().map_or(0, |error| error.to_string().len());
                prop_assert!(words < WORDS, "{words} bytes");
            }
        }
        let name = AgentId::new(&text).err().map_or(0, |error| error.to_string().len());
        prop_assert!(name < WORDS, "{name} bytes");
        for Kind { letter, digest, .. } in kinds() {
            let payload = [&[VERSION, letter, 32], text.as_bytes()].concat();
            let words = digest(&payload).err().map_or(0, |error| error.to_string().len());
            prop_assert!(words < WORDS, "{words} bytes");
        }
    }

    #[test]
    fn a_flood_of_random_bytes_behind_a_valid_preamble_is_an_error_or_a_valid_frame(noise in vec(any::<u8>(), 0..400)) {
        for Kind { letter, digest, .. } in kinds() {
            let _outcome = digest(&[&[VERSION, letter], noise.as_slice()].concat());
        }
    }

    #[test]
    fn a_damaged_detection_frame_is_an_error_or_a_valid_frame(
        frame in strategy::detection_frame(), damage in vec((any::<Index>(), any::<u8>()), 1..6)
    ) {
        let mut bytes = Vec::new();
        detections::encode(&frame, &mut bytes).unwrap();
        damage.iter().for_each(|(place, byte)| *place.get_mut(&mut bytes) = *byte);
        let _outcome = digest_detections(&bytes);
    }

    #[test]
    fn a_damaged_fused_frame_is_an_error_or_a_valid_frame(
        frame in strategy::fused_frame(), damage in vec((any::<Index>(), any::<u8>()), 1..6)
    ) {
        let mut bytes = Vec::new();
        fused::encode(&frame, &mut bytes).unwrap();
        damage.iter().for_each(|(place, byte)| *place.get_mut(&mut bytes) = *byte);
        let _outcome = digest_fused(&bytes);
    }

    #[test]
    fn a_damaged_delta_frame_is_an_error_or_a_valid_frame(
        frame in strategy::delta_frame(), damage in vec((any::<Index>(), any::<u8>()), 1..6)
    ) {
        let mut bytes = Vec::new();
        delta::encode(&frame, &mut bytes).unwrap();
        damage.iter().for_each(|(place, byte)| *place.get_mut(&mut bytes) = *byte);
        let _outcome = digest_delta(&bytes);
    }
}
