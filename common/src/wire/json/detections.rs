//! Detection frames as JSON.

use super::partial::{PartialDetection, PartialSigma, ReportDefaults};
use super::values::{Id64, Stamp, covariance, deviations, number, optional_number};
use super::values::{parse, print, with_quoted_words};
use crate::class::Class;
use crate::conventions::Conventions;
use crate::covariance::Velocity;
use crate::detection::{Detection, DetectionFrame, HeadingKind, MAX_DETECTIONS};
use crate::geometry::Pose;
use crate::id::{AgentId, FrameId, MapFrame};
use crate::reported::Reported;
use crate::unmapped_names::UnmappedNames;
use crate::wire::error::WireError;
use crate::wire::foreign::Foreign;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// A decoded frame, and the names of classes that could not be mapped.
#[derive(Clone, Debug, PartialEq)]
pub struct DecodedDetections {
    /// The frame.
    pub frame: DetectionFrame,
    /// The detections with an unknown class name; they became [`Class::Unknown`].
    pub unmapped_classes: UnmappedNames,
    /// How it was written.
    pub reported: Reported,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a frame with `captured_at` and `detections`")]
struct JsonFrame<'a> {
    captured_at: Stamp,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    agent: Option<AgentId>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    epoch: Option<Id64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sequence: Option<Id64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sensor_pose: Option<JsonPose>,
    #[serde(default)]
    sensor_revision: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    map_frame: Option<MapFrame>,
    #[serde(borrow, deserialize_with = "limited")]
    detections: Vec<JsonDetection<'a>>,
}

/// [`Pose`] with names for numbers that are not finite.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = r#"an object such as {"x": 8.0, "y": -8.0, "yaw": 2.356} (m, rad)"#)]
struct JsonPose {
    #[serde(deserialize_with = "number")]
    x: f64,
    #[serde(deserialize_with = "number")]
    y: f64,
    #[serde(default, deserialize_with = "number")]
    yaw: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = r#"a detection such as {"class": "car", "x": 10.0, "y": 5.0}"#)]
struct JsonDetection<'a> {
    #[serde(borrow)]
    class: std::borrow::Cow<'a, str>,
    #[serde(deserialize_with = "number")]
    x: f64,
    #[serde(deserialize_with = "number")]
    y: f64,
    #[serde(default, deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    w: Option<f64>,
    #[serde(default, deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    d: Option<f64>,
    #[serde(default, deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    yaw: Option<f64>,
    #[serde(default, deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    score: Option<f64>,
    #[serde(default, deserialize_with = "heading", skip_serializing_if = "Option::is_none")]
    heading: Option<HeadingKind>,
    #[serde(default)]
    sigma: JsonSigma,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    velocity: Option<JsonVelocity>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    source_track: Option<Id64>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = r#"an object such as {"x": 0.3, "y": 0.3} (m)"#)]
struct JsonSigma {
    #[serde(deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    #[serde(deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
    #[serde(deserialize_with = "number")]
    rho: f64,
    #[serde(deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    w: Option<f64>,
    #[serde(deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    d: Option<f64>,
    #[serde(deserialize_with = "optional_number", skip_serializing_if = "Option::is_none")]
    yaw: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = r#"an object such as {"x": 8.0, "y": 0.0, "sigma_x": 0.5, "sigma_y": 0.5} (m/s)"#
)]
struct JsonVelocity {
    #[serde(deserialize_with = "number")]
    x: f64,
    #[serde(deserialize_with = "number")]
    y: f64,
    #[serde(deserialize_with = "number")]
    sigma_x: f64,
    #[serde(deserialize_with = "number")]
    sigma_y: f64,
    #[serde(default, deserialize_with = "number")]
    rho: f64,
}

/// All kinds of headings.
const HEADING_KINDS: [HeadingKind; 3] = [HeadingKind::Known, HeadingKind::Axis, HeadingKind::Unknown];
/// What is said of a list that is longer than allowed.
const TOO_MANY: &str = "more detections than a frame may hold";

/// What is known of a heading. A number there is the angle of another format.
fn heading<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<HeadingKind>, D::Error> {
    struct Heading;
    impl Visitor<'_> for Heading {
        type Value = Option<HeadingKind>;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str("\"known\", \"axis\" or \"unknown\" as `heading`; the angle is `yaw`")
        }

        fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
            let kind = HEADING_KINDS.into_iter().find(|kind| kind.name() == text);
            let names = &["known", "axis", "unknown"];
            kind.map(Some).ok_or_else(|| E::unknown_variant(text, names))
        }

        fn visit_unit<E: serde::de::Error>(self) -> Result<Self::Value, E> {
            Ok(None)
        }
    }
    deserializer.deserialize_any(Heading)
}

/// At most [`MAX_DETECTIONS`] detections: a longer list is not read to its end.
fn limited<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<JsonDetection<'de>>, D::Error> {
    struct Limited;
    impl<'de> Visitor<'de> for Limited {
        type Value = Vec<JsonDetection<'de>>;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str("a list of detections")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
            let mut detections = Vec::new();
            while let Some(detection) = list.next_element()? {
                if detections.len() >= MAX_DETECTIONS {
                    return Err(A::Error::custom(TOO_MANY));
                }
                detections.push(detection);
            }
            Ok(detections)
        }
    }
    deserializer.deserialize_seq(Limited)
}

/// The frame of a JSON text, validated. `agent` is the sender by the key; a frame that names another one is returned
/// as it is, and the receiver decides whether to refuse it.
///
/// Without a sequence number the capture time stands in for it: such an agent can send one frame per
/// microsecond.
pub fn decode_detections(
    bytes: &[u8],
    agent: AgentId,
    defaults: &ReportDefaults,
) -> Result<DecodedDetections, WireError> {
    let decoded = decode_detections_as_sent(bytes, agent, defaults)?;
    decoded.frame.validate()?;
    Ok(decoded)
}

/// The same, with the detections as they were sent: the frame itself is validated, but a detection can have a value
/// outside of its limits ([`Detection::validate`]). For a receiver that drops single detections.
///
/// Numbers that are not finite are read as such: `null`, and `NaN` and `Infinity` as Python writes them.
pub fn decode_detections_as_sent(
    bytes: &[u8],
    agent: AgentId,
    defaults: &ReportDefaults,
) -> Result<DecodedDetections, WireError> {
    decode_detections_by(bytes, agent, defaults, &Conventions::default())
}

/// The same, of an agent with conventions of its own.
pub fn decode_detections_by(
    bytes: &[u8],
    agent: AgentId,
    defaults: &ReportDefaults,
    conventions: &Conventions,
) -> Result<DecodedDetections, WireError> {
    let to_frame = |json: &JsonFrame<'_>| to_frame(json, agent, (defaults, conventions));
    match parse(bytes) {
        Ok(json) => to_frame(&json),
        Err(WireError::Json(words)) if words.starts_with(TOO_MANY) => Err(WireError::TooMany {
            what: "detections",
            count: MAX_DETECTIONS as u64 + 1,
            limit: MAX_DETECTIONS,
        }),
        Err(error) => match with_quoted_words(bytes) {
            Some(quoted) => to_frame(&parse(&quoted)?),
            None => Err(other_format(bytes).unwrap_or(error)),
        },
    }
}

/// What is said to be JSON and is something else. What is text is answered by the reader of JSON, which says where.
fn other_format(bytes: &[u8]) -> Option<WireError> {
    let format = Foreign::of(bytes).filter(|format| !format.is_text());
    format.map(WireError::OtherFormat)
}

fn to_frame(
    json: &JsonFrame<'_>,
    agent: AgentId,
    (defaults, conventions): (&ReportDefaults, &Conventions),
) -> Result<DecodedDetections, WireError> {
    let mut unmapped_classes = UnmappedNames::default();
    let mut reported = Reported { is_json: true, ..Reported::by(conventions, json.sequence.is_some()) };
    let pose = json.sensor_pose.as_ref().map(|pose| Pose { x: pose.x, y: pose.y, yaw: pose.yaw });
    let conversion = conventions.conversion(pose)?;
    reported.pose_yaw = pose.map_or(0.0, |pose| conversion.heading(pose.yaw));
    let detections = json.detections.iter().map(|detection| {
        let class = conventions.class(&detection.class).unwrap_or_else(|| {
            unmapped_classes.add(&detection.class);
            Class::Unknown
        });
        reported.without_sigma += u64::from(detection.sigma.x.is_none());
        detection.yaw.iter().for_each(|yaw| reported.headings.note(conversion.heading(*yaw)));
        let off = conventions.frame.off_origin([detection.x, detection.y]);
        off.into_iter().for_each(|off| reported.off_origin.note(off));
        detection.partial(class).completed(defaults, &conversion)
    });
    let detections = detections.collect();
    if reported.may_be_of_other_unit() {
        let headings = json.detections.iter().map(|one| one.yaw.unwrap_or(f64::NAN));
        reported.in_other_unit = headings.map(|yaw| conversion.heading_in_other_unit(yaw)).collect();
    }
    let captured_at = json.captured_at.micros()?;
    let by_time = u64::try_from(captured_at.as_micros()).unwrap_or(0);
    let frame = DetectionFrame {
        id: FrameId {
            agent: json.agent.unwrap_or(agent),
            epoch: json.epoch.map_or(0, |id| id.0),
            sequence: json.sequence.map_or(by_time, |id| id.0),
        },
        captured_at: captured_at + conventions.time_offset,
        sensor_pose: conversion.sensor_pose(),
        sensor_revision: json.sensor_revision,
        map_frame: json.map_frame,
        detections,
    };
    frame.validate_head()?;
    Ok(DecodedDetections { frame, unmapped_classes, reported })
}

impl JsonDetection<'_> {
    fn partial(&self, class: Class) -> PartialDetection {
        let JsonSigma { x, y, rho, w, d, yaw } = self.sigma;
        PartialDetection {
            class,
            x: self.x,
            y: self.y,
            w: self.w,
            d: self.d,
            yaw: self.yaw,
            score: self.score,
            heading: self.heading,
            sigma: PartialSigma { x, y, rho, w, d, yaw },
            velocity: self.velocity.as_ref().map(|velocity| {
                let JsonVelocity { x, y, sigma_x, sigma_y, rho } = *velocity;
                Velocity { x, y, covariance: covariance(sigma_x, sigma_y, rho) }
            }),
            source_track: self.source_track.map(|id| id.0),
        }
    }

    fn from_detection(detection: &Detection) -> JsonDetection<'static> {
        let Detection { bev, covariance, .. } = detection;
        let (sigma_x, sigma_y, rho) = deviations(&covariance.position);
        JsonDetection {
            class: detection.class.name().into(),
            x: bev.x,
            y: bev.y,
            w: Some(bev.w),
            d: Some(bev.d),
            yaw: Some(bev.yaw),
            score: Some(detection.score),
            sigma: JsonSigma {
                x: Some(sigma_x),
                y: Some(sigma_y),
                rho,
                w: Some(libm::sqrt(covariance.ww)),
                d: Some(libm::sqrt(covariance.dd)),
                yaw: Some(libm::sqrt(covariance.yaw)),
            },
            velocity: detection.velocity.as_ref().map(|velocity| {
                let (sigma_x, sigma_y, rho) = deviations(&velocity.covariance);
                JsonVelocity { x: velocity.x, y: velocity.y, sigma_x, sigma_y, rho }
            }),
            heading: Some(detection.heading),
            source_track: detection.source_track.map(Id64),
        }
    }
}

/// The frame as JSON, with every field.
pub fn encode_detections(frame: &DetectionFrame) -> Result<Vec<u8>, WireError> {
    frame.validate()?;
    print(&JsonFrame {
        captured_at: Stamp::Micros(frame.captured_at),
        agent: Some(frame.id.agent),
        epoch: Some(Id64(frame.id.epoch)),
        sequence: Some(Id64(frame.id.sequence)),
        sensor_pose: frame.sensor_pose.map(|Pose { x, y, yaw }| JsonPose { x, y, yaw }),
        sensor_revision: frame.sensor_revision,
        map_frame: frame.map_frame,
        detections: frame.detections.iter().map(JsonDetection::from_detection).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(text: &str) -> Result<DecodedDetections, WireError> {
        decode_detections(text.as_bytes(), AgentId::new("cam").unwrap(), &ReportDefaults::default())
    }

    #[test]
    fn a_list_longer_than_allowed_is_not_read_to_its_end() {
        let agent = AgentId::new("a").unwrap();
        let decode = |count: usize, rest: &str| {
            let one = "{\"class\":\"car\",\"x\":1,\"y\":2}";
            let list = vec![one; count].join(",");
            let text = format!("{{\"captured_at\":1790000000000000,\"detections\":[{list}{rest}");
            decode_detections(text.as_bytes(), agent, &ReportDefaults::default())
        };
        assert_eq!(decode(MAX_DETECTIONS, "]}").unwrap().frame.detections.len(), MAX_DETECTIONS);
        // What follows is no JSON: nobody has read it.
        let error = decode(MAX_DETECTIONS + 1, ", ...").unwrap_err();
        assert_eq!(error.reason(), "too_many", "{error}");
    }

    #[test]
    fn time_class_and_position_are_enough() {
        let text =
            r#"{"captured_at": 1790000000000000, "detections": [{"class": "car", "x": 1.0, "y": 2.0}]}"#;
        let decoded = decode(text).unwrap();
        let detection = decoded.frame.detections[0];
        assert_eq!(decoded.frame.id.agent.as_str(), "cam");
        assert_eq!(decoded.frame.id.sequence, 1_790_000_000_000_000);
        assert_eq!((detection.class, detection.bev.w, detection.bev.d), (Class::Car, 1.8, 4.5));
        assert!(detection.covariance.yaw > 3.0, "an unknown heading must weigh nothing");
    }

    #[test]
    fn an_unmapped_class_is_counted_and_kept_as_unknown() {
        let text = r#"{"captured_at": 1, "detections": [{"class": "ufo", "x": 1.0, "y": 2.0}]}"#;
        let decoded = decode(text).unwrap();
        assert_eq!(
            (decoded.unmapped_classes.total(), decoded.frame.detections[0].class),
            (1, Class::Unknown)
        );
        assert!(decoded.unmapped_classes.names().eq([("ufo", 1)]));
    }

    #[test]
    fn errors_name_the_field() {
        let cases = [
            (r#"{"detections": []}"#, "captured_at"),
            (r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1}]}"#, "y"),
            (
                r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 2, "theta": 1}]}"#,
                "`theta` (did you mean `yaw`?)",
            ),
            (r#"{"capturd_at": 1, "detections": []}"#, "`capturd_at` (did you mean `captured_at`?)"),
            (r#"{"timestamp": 1, "detections": []}"#, "`timestamp` (did you mean `captured_at`?)"),
            (r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 2, "w": -1}]}"#, "w"),
            (
                r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 2, "sigma": {"d": -1}}]}"#,
                "variance of d",
            ),
            (r#"{"captured_at": 1.5, "detections": []}"#, "1.5"),
            (
                r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 2, "heading": 1.57}]}"#,
                "`heading`; the angle is `yaw`",
            ),
            (
                r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 2, "heading": "north"}]}"#,
                "unknown variant `north`, expected one of `known`, `axis`, `unknown`",
            ),
            (
                r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 2, "sigma": 0.3}]}"#,
                r#"expected an object such as {"x": 0.3, "y": 0.3} (m)"#,
            ),
            (
                r#"{"captured_at": 1, "detections": [{"class": "car", "x": 1, "y": 2, "velocity": 8}]}"#,
                r#""sigma_y": 0.5} (m/s)"#,
            ),
            (
                "{\"captured_at\": 1,\n\"detections\": [{\"class\": \"a: b\", \"x\" : \"1\", \"y\": 2}]}",
                "in the value of `x`",
            ),
            (r#"{"captured_at": 1, "detections": {"class": "car"}}"#, "a list of detections"),
            (r#"{"captured_at": 1, "agent": "a/b", "detections": []}"#, "a/b"),
        ];
        for (text, named) in cases {
            let message = decode(text).unwrap_err().to_string();
            assert!(message.contains(named), "{message:?} should name {named:?}");
        }
    }

    #[test]
    fn a_number_that_is_not_finite_is_named_by_index_and_field_and_spares_the_frame() {
        let car = r#"{"class": "car", "x": 1.0, "y": 2.0}"#;
        let bad = [
            ("y", r#"{"class": "car", "x": 1.0, "y": NaN}"#),
            ("x", r#"{"class": "car", "x": -Infinity, "y": 0}"#),
            ("x", r#"{"class": "car", "x": null, "y": 0}"#),
            ("w", r#"{"class": "car", "x": 1.0, "y": 2.0, "w": NaN, "d": 4}"#),
            ("score", r#"{"class": "car", "x": 1.0, "y": 2.0, "score": NaN}"#),
            ("variance of d", r#"{"class": "car", "x": 1.0, "y": 2.0, "sigma": {"d": Infinity}}"#),
            (
                "velocity x",
                r#"{"class": "car", "x": 1, "y": 2, "velocity": {"x": NaN, "y": 0, "sigma_x": 1, "sigma_y": 1}}"#,
            ),
        ];
        for (field, bad) in bad {
            let text = format!(r#"{{"captured_at": 1, "detections": [{car}, {bad}, {car}]}}"#);
            let message = decode(&text).unwrap_err().to_string();
            assert!(message.starts_with(&format!("{field} of detection 1 is ")), "{message}");
            let defaults = ReportDefaults::default();
            let agent = AgentId::new("cam").unwrap();
            let decoded = decode_detections_as_sent(text.as_bytes(), agent, &defaults).unwrap();
            let valid = decoded.frame.detections.iter().map(|one| one.validate(None).is_ok());
            assert!(valid.eq([true, false, true]), "{text}");
        }
        let text = r#"{"captured_at": 1, "sensor_pose": {"x": NaN, "y": 0}, "detections": []}"#;
        assert_eq!(decode(text).unwrap_err().to_string().split(',').next(), Some("sensor_pose.x is NaN"));
    }

    #[test]
    fn a_stamp_that_is_no_integer_of_microseconds_is_refused_with_its_likely_unit() {
        let cases = [
            ("1795826320182482000", "(it seems to be in nanoseconds)"),
            ("1795826320.182", "(it seems to be in seconds)"),
            ("1795826320182.5", "(it seems to be in milliseconds)"),
            ("1795826320182482.0", "(microseconds, but a number with a fraction)"),
        ];
        for (stamp, unit) in cases {
            let error = decode(&format!(r#"{{"captured_at": {stamp}, "detections": []}}"#)).unwrap_err();
            assert_eq!(error.reason(), "wrong_time_unit");
            assert!(error.to_string().contains(unit), "{error}");
        }
    }
}
