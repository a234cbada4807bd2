//! Fused frames as JSON.

use super::values::{Id64, Micros, parse, print};
use crate::class::Class;
use crate::fused::{
    AgentHealth, FusedFrame, FusedObject, Inclusion, KINEMATIC_DIAGONAL, KinematicCovariance,
};
use crate::geometry::BevBox;
use crate::id::{AgentId, FrameId, HubId, MapFrame, MeasurementId, TrackId};
use crate::time::Span;
use crate::wire::error::WireError;
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonFused {
    hub: HubId,
    lineage: u32,
    sequence: Id64,
    fused_at: Micros,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    map_frame: Option<MapFrame>,
    objects: Vec<JsonObject>,
    agents: Vec<JsonAgent>,
    includes: Vec<JsonInclusion>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonObject {
    track: Id64,
    class: Class,
    class_probabilities: Vec<(Class, f64)>,
    x: f64,
    y: f64,
    w: f64,
    d: f64,
    yaw: f64,
    vx: f64,
    vy: f64,
    sigma: JsonObjectSigma,
    kinematic_covariance: KinematicCovariance,
    existence: f64,
    age_us: i64,
    last_measured_at: Micros,
    contributors: Vec<JsonMeasurement>,
}

/// Standard deviations; written for convenience, read back from the variances.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonObjectSigma {
    x: f64,
    y: f64,
    vx: f64,
    vy: f64,
    w: f64,
    d: f64,
    yaw: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonMeasurement {
    agent: AgentId,
    epoch: Id64,
    sequence: Id64,
    index: u16,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonAgent {
    agent: AgentId,
    epoch: Id64,
    newest_captured_at: Micros,
    accepted: u64,
    refused: u64,
    out_of_sequence: u64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JsonInclusion {
    agent: AgentId,
    epoch: Id64,
    sequence: Id64,
    captured_at: Micros,
    received_at: Micros,
}

impl From<&FusedObject> for JsonObject {
    fn from(object: &FusedObject) -> Self {
        let covariance = &object.kinematic_covariance;
        Self {
            track: Id64(object.track.0),
            class: object.class,
            class_probabilities: object.classes().collect(),
            x: object.bev.x,
            y: object.bev.y,
            w: object.bev.w,
            d: object.bev.d,
            yaw: object.bev.yaw,
            vx: object.velocity.0,
            vy: object.velocity.1,
            sigma: JsonObjectSigma {
                x: libm::sqrt(covariance[0]),
                y: libm::sqrt(covariance[4]),
                vx: libm::sqrt(covariance[7]),
                vy: libm::sqrt(covariance[9]),
                w: libm::sqrt(object.ww),
                d: libm::sqrt(object.dd),
                yaw: libm::sqrt(object.yaw_variance),
            },
            kinematic_covariance: *covariance,
            existence: object.existence,
            age_us: object.age.as_nanos() / 1_000,
            last_measured_at: Micros(object.last_measured_at),
            contributors: object
                .contributors
                .iter()
                .map(|measurement| JsonMeasurement {
                    agent: measurement.frame.agent,
                    epoch: Id64(measurement.frame.epoch),
                    sequence: Id64(measurement.frame.sequence),
                    index: measurement.index,
                })
                .collect(),
        }
    }
}

impl From<JsonObject> for FusedObject {
    fn from(json: JsonObject) -> Self {
        let mut object = Self {
            track: TrackId(json.track.0),
            class: json.class,
            class_probabilities: json.class_probabilities,
            bev: BevBox { x: json.x, y: json.y, w: json.w, d: json.d, yaw: json.yaw },
            velocity: (json.vx, json.vy),
            kinematic_covariance: json.kinematic_covariance,
            ww: json.sigma.w * json.sigma.w,
            dd: json.sigma.d * json.sigma.d,
            yaw_variance: json.sigma.yaw * json.sigma.yaw,
            existence: json.existence,
            age: Span::from_micros(json.age_us),
            last_measured_at: json.last_measured_at.0,
            contributors: json
                .contributors
                .into_iter()
                .map(|measurement| MeasurementId {
                    frame: FrameId {
                        agent: measurement.agent,
                        epoch: measurement.epoch.0,
                        sequence: measurement.sequence.0,
                    },
                    index: measurement.index,
                })
                .collect(),
        };
        object.class_probabilities = object.classes().collect();
        object
    }
}

impl From<&AgentHealth> for JsonAgent {
    fn from(health: &AgentHealth) -> Self {
        Self {
            agent: health.agent,
            epoch: Id64(health.epoch),
            newest_captured_at: Micros(health.newest_captured_at),
            accepted: health.accepted,
            refused: health.refused,
            out_of_sequence: health.out_of_sequence,
        }
    }
}

impl From<JsonAgent> for AgentHealth {
    fn from(json: JsonAgent) -> Self {
        Self {
            agent: json.agent,
            epoch: json.epoch.0,
            newest_captured_at: json.newest_captured_at.0,
            accepted: json.accepted,
            refused: json.refused,
            out_of_sequence: json.out_of_sequence,
        }
    }
}

impl From<&Inclusion> for JsonInclusion {
    fn from(inclusion: &Inclusion) -> Self {
        Self {
            agent: inclusion.frame.agent,
            epoch: Id64(inclusion.frame.epoch),
            sequence: Id64(inclusion.frame.sequence),
            captured_at: Micros(inclusion.captured_at),
            received_at: Micros(inclusion.received_at),
        }
    }
}

impl From<JsonInclusion> for Inclusion {
    fn from(json: JsonInclusion) -> Self {
        Self {
            frame: FrameId { agent: json.agent, epoch: json.epoch.0, sequence: json.sequence.0 },
            captured_at: json.captured_at.0,
            received_at: json.received_at.0,
        }
    }
}

/// JSON cannot represent a number that is not finite; the root of a negative variance is not a number.
fn check_finite(object: &FusedObject) -> Result<(), WireError> {
    let FusedObject { bev, velocity, .. } = object;
    let fields = [
        ("x", bev.x),
        ("y", bev.y),
        ("w", bev.w),
        ("d", bev.d),
        ("yaw", bev.yaw),
        ("vx", velocity.0),
        ("vy", velocity.1),
        ("sigma.w", libm::sqrt(object.ww)),
        ("sigma.d", libm::sqrt(object.dd)),
        ("sigma.yaw", libm::sqrt(object.yaw_variance)),
        ("existence", object.existence),
    ];
    let variances = KINEMATIC_DIAGONAL.map(|place| object.kinematic_covariance[place]);
    let sigmas = variances.map(|variance| ("sigma", libm::sqrt(variance)));
    let covariance = object.kinematic_covariance.iter().map(|value| ("kinematic covariance", *value));
    let classes = object.class_probabilities.iter().map(|(_, value)| ("class probability", *value));
    match fields
        .into_iter()
        .chain(sigmas)
        .chain(covariance)
        .chain(classes)
        .find(|(_, value)| !value.is_finite())
    {
        Some((field, value)) => Err(WireError::NotEncodable { field, value }),
        None => Ok(()),
    }
}

/// The frame as JSON.
pub fn encode_fused(frame: &FusedFrame) -> Result<Vec<u8>, WireError> {
    frame.objects.iter().try_for_each(check_finite)?;
    print(&JsonFused {
        hub: frame.hub,
        lineage: frame.lineage,
        sequence: Id64(frame.sequence),
        fused_at: Micros(frame.fused_at),
        map_frame: frame.map_frame,
        objects: frame.objects.iter().map(JsonObject::from).collect(),
        agents: frame.agents.iter().map(JsonAgent::from).collect(),
        includes: frame.includes.iter().map(JsonInclusion::from).collect(),
    })
}

/// The frame of a JSON text; times are cut to microseconds.
pub fn decode_fused(bytes: &[u8]) -> Result<FusedFrame, WireError> {
    let json: JsonFused = parse(bytes)?;
    Ok(FusedFrame {
        hub: json.hub,
        lineage: json.lineage,
        sequence: json.sequence.0,
        fused_at: json.fused_at.0,
        map_frame: json.map_frame,
        objects: json.objects.into_iter().map(FusedObject::from).collect(),
        agents: json.agents.into_iter().map(AgentHealth::from).collect(),
        includes: json.includes.into_iter().map(Inclusion::from).collect(),
    })
}
