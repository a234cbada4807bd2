//! What to do about frames that are refused.

use crate::engine::Refusal;
use v2x_common::wire::{Foreign, WireError};

/// Where each field is described.
const SCHEMA: &str = "Each field is described in `common/schemas/detection-frame.schema.json`";
/// The smallest frame with a detection.
const SMALLEST: &str =
    r#"{"captured_at": 1790000000000000, "detections": [{"class": "car", "x": 10.0, "y": 5.0}]}"#;
/// How the reader of JSON says that a name is in single quotes, or in none.
const NO_QUOTED_KEY: &str = "key must be a string";
/// Fields of positions in degrees, as other formats call them.
const DEGREES: [&str; 5] = ["lat", "latitude", "lon", "lng", "longitude"];

/// By the reason, and where this is too little by the newest refusal itself.
pub(super) fn remedy(reason: &str, newest: &Refusal) -> String {
    match newest {
        Refusal::Malformed(WireError::Json(words)) => of_json(words),
        Refusal::Malformed(WireError::OtherFormat(format)) => of_format(*format),
        Refusal::AgentMismatch { payload, key } => format!(
            "Write {key} as `agent` in the payload, or {payload} in the key; JSON may leave `agent` out"
        ),
        _ => by_reason(reason).to_owned(),
    }
}

/// By the format that a payload is in.
fn of_format(format: Foreign) -> String {
    let how = match format {
        Foreign::Compressed(_) => "Send it as it was before it was compressed",
        Foreign::JsonAsCompact => {
            return "Publish it with the encoding `application/json`, or with none: `application/vnd.v2x.postcard` is the compact format"
                .to_owned();
        }
        Foreign::JsonList => "A frame is one JSON object, which has the list as `detections`",
        Foreign::JsonTwice => "Encode it once: what is given to `json.dumps` is an object, and no text",
        Foreign::ByteOrderMark | Foreign::Utf16 => "Write UTF-8 without a byte order mark",
        Foreign::Base64 => "Send what was encoded: a payload may hold any bytes",
        Foreign::Binary(_) | Foreign::Xml | Foreign::Text => {
            "Send JSON, or the compact format of deploy/docs/wire.md"
        }
    };
    format!("{how}. Each sample is one whole JSON object, in UTF-8: `{SMALLEST}`")
}

/// By what the reader of JSON says.
fn of_json(words: &str) -> String {
    let named = |begin: &str| words.strip_prefix(begin)?.split('`').next();
    if let Some(field @ ("sigma_x" | "sigma_y")) = named("missing field `") {
        return format!(
            "Add `{field}` to `velocity`: it has standard deviations of its own (m/s), as in `{{\"x\": 8.0, \"y\": 0.0, \"sigma_x\": 0.5, \
             \"sigma_y\": 0.5}}`; where it is not measured, leave it out"
        );
    }
    if let Some(field) = named("missing field `") {
        return format!(
            "Add `{field}`. A frame needs `captured_at` and `detections`, each detection `class`, `x` and `y`: `{SMALLEST}`"
        );
    }
    if let Some(field) = named("unknown field `") {
        let is_degrees = DEGREES.contains(&field.to_ascii_lowercase().as_str());
        return if is_degrees {
            "Write metres in the map frame as `x` and `y`; or the longitude as `x` and the latitude as `y`, in degrees, with \
             `frame = \"wgs84\"` and `origin` for this agent in the hub's configuration"
                .to_owned()
        } else {
            format!("Rename it, or leave it out. {SCHEMA}")
        };
    }
    if words.contains("in the value of `heading`") || words.contains("`known`, `axis`, `unknown`") {
        return format!(
            "`heading` says what is known of it: \"known\", \"axis\" or \"unknown\"; the angle is `yaw` (rad). {SCHEMA}"
        );
    }
    if words.contains("in the value of `class`") {
        return format!(
            "`class` is a name as a text, such as \"car\"; other names than those of deploy/docs/wire.md are translated by `classes` for this agent in \
             the hub's configuration. {SCHEMA}"
        );
    }
    if words.starts_with("name \"") {
        return "Give it a name of letters without accents, digits, '-', '_', '.' and ':', the same in the key and as `agent`; JSON may leave `agent` out"
            .to_owned();
    }
    if words.starts_with("invalid type")
        || words.starts_with("invalid value")
        || words.starts_with("unknown variant")
    {
        return format!("Numbers are numbers and not texts, lists are lists. {SCHEMA}");
    }
    if words.starts_with(NO_QUOTED_KEY) {
        return format!(
            "Names and texts of JSON are in double quotes: in Python `json.dumps(frame)` writes them, `str(frame)` does not. Each sample is one \
             whole JSON object, in UTF-8: `{SMALLEST}`"
        );
    }
    format!("Each sample is one whole JSON object, in UTF-8: `{SMALLEST}`")
}

fn by_reason(reason: &str) -> &'static str {
    match reason {
        "wrong_time_unit" => {
            "`captured_at` is Unix time: whole microseconds in JSON (Python: `time.time_ns() // 1000`), nanoseconds in the \
             compact format"
        }
        "too_late" => {
            "Its clock is behind, or its link is slower than `delta_max_ms` of the hub: set the clock, or raise that"
        }
        "too_early" => "Its clock is ahead: set it (chrony, PTP)",
        "map_frame_mismatch" => "Send positions in the hub's map frame, with its name or with none",
        "no_sensor_pose" => {
            "Send `sensor_pose` with each frame, or set the hub's `frame` for this agent to `map` or `sensor`"
        }
        "off_origin" => {
            "With `frame = \"wgs84\"` in the hub's settings x is the longitude and y the latitude in degrees, also in `sensor_pose`; \
             where these are exchanged, send them so, or write `frame = \"wgs84-lat-lon\"`; is `origin` right?"
        }
        "queue_full" if cfg!(debug_assertions) => {
            "This hub was built without optimisation, which costs several times the time: build it with `--release`"
        }
        "queue_full" => {
            "Fewer agents, lower rates, fewer detections in each frame, or a faster machine for the hub"
        }
        "overloaded" | "too_many_frames" | "too_many_detections" | "too_many" | "too_large" => {
            "It sends more than its share: fewer frames, or fewer detections in each"
        }
        "out_of_sequence" => {
            "Late data is dropped, as `late_data` of the hub says: `replay` there fuses it at its own time"
        }
        "too_many_agents" => "End agents that are of no use, or use several hubs, each with its own area",
        "absurd_value" | "bad_name" => "Correct the value that is named; the other frames are taken",
        // What the compact format's reader says.
        _ => {
            "It was read as the compact format. If it is JSON, it begins with `{`, or has the encoding `application/json`; \
             if it is compact, is its sender of this hub's version?"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::AgentId;
    use v2x_common::wire::json::{ReportDefaults, decode_detections};

    fn of_payload(text: &str) -> String {
        let agent = AgentId::new("cam").unwrap();
        let error = decode_detections(text.as_bytes(), agent, &ReportDefaults::default()).unwrap_err();
        remedy(error.reason(), &Refusal::Malformed(error.clone()))
    }

    #[test]
    fn refused_json_is_answered_by_what_is_wrong_with_it_and_not_by_a_question_about_its_encoding() {
        for (text, expected) in [
            ("{\"captured_at\": 1}", "Add `detections`"),
            ("{\"detections\": []}", "Add `captured_at`"),
            ("{\"captured_at\": 1, \"detections\": [{\"class\": \"car\", \"x\": 1}]}", "Add `y`"),
            ("{\"capturd_at\": 1}", "Rename it"),
            (
                "{\"captured_at\": 1, \"detections\": [{\"class\": \"car\", \"x\": 1, \"y\": 1, \"velocity\": {\"x\": 1, \"y\": 0}}]}",
                "to `velocity`",
            ),
            ("{\"captured_at\": 1, \"detections\": [{\"lat\": 48.1}]}", "frame = \"wgs84\""),
            ("{\"captured_at\": 1, \"detections\": [{\"class\": \"car\", \"x\": \"1\"}]}", "not texts"),
            ("{\"captured_at\": 1", "one whole JSON object"),
            ("[]", "one whole JSON object"),
            ("{'captured_at': 1}", "json.dumps"),
            ("{\"captured_at\": 1, \"detections\": [{\"class\": 2, \"x\": 1, \"y\": 1}]}", "such as \"car\""),
            (
                "{\"captured_at\": 1, \"detections\": [{\"class\": \"car\", \"x\": 1, \"y\": 1, \"heading\": 1.57}]}",
                "the angle is `yaw`",
            ),
            (
                "{\"captured_at\": 1, \"detections\": [{\"class\": \"car\", \"x\": 1, \"y\": 1, \"sigma\": 0.3}]}",
                "lists are lists",
            ),
        ] {
            let words = of_payload(text);
            assert!(words.contains(expected) && !words.contains("encoding"), "{text}: {words}");
        }
        assert!(remedy("truncated", &Refusal::Malformed(WireError::Truncated)).contains("application/json"));
    }

    #[test]
    fn payloads_of_other_formats_are_answered_with_what_they_look_like_and_what_to_send() {
        use v2x_common::wire::detections;
        for (payload, looks_like, advice) in [
            (&b"\x1f\x8b\x08\x00\x00\x00\x00"[..], "looks like gzip", "before it was compressed"),
            (b"\x82\xabcaptured_at\xcf\x00", "looks like MessagePack", "Send JSON, or the compact format"),
            (b"[{\"class\": \"car\"}]", "looks like a JSON list", "as `detections`"),
            (b"eyJjYXB0dXJlZF9hdCI6IDE3OTB9", "looks like base64", "what was encoded"),
            (b"{\"captured_at\": 1}", "its encoding says", "application/json"),
        ] {
            let error = detections::decode(payload).unwrap_err();
            let words = remedy(error.reason(), &Refusal::Malformed(error.clone()));
            assert_eq!(error.reason(), "other_format");
            assert!(error.to_string().contains(looks_like) && words.contains(advice), "{error}: {words}");
        }
        // The encoding says JSON.
        let agent = AgentId::new("cam").unwrap();
        let packed = decode_detections(b"\x1f\x8b\x08\x00", agent, &ReportDefaults::default()).unwrap_err();
        assert_eq!(packed.to_string(), "the payload looks like gzip");
    }

    #[test]
    fn the_smallest_frame_that_is_shown_is_one() {
        let agent = AgentId::new("cam").unwrap();
        decode_detections(SMALLEST.as_bytes(), agent, &ReportDefaults::default()).unwrap();
    }

    #[test]
    fn two_names_of_one_agent_are_both_said() {
        let [payload, key] = ["cam", "kam"].map(|name| AgentId::new(name).unwrap());
        let words = remedy("agent_mismatch", &Refusal::AgentMismatch { payload, key });
        assert!(words.contains("kam as `agent`") && words.contains("cam in the key"), "{words}");
    }
}
