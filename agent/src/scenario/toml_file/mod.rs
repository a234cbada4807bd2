//! The scenario file as it is typed. Defaults are stated where values get their meaning.

use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use v2x_common::sensor::SensorKind;

use crate::link::{LinkConfig, profiles};
use crate::noise::NoiseLevel;
use crate::pose_error::PoseError;
use std::path::PathBuf;

mod sending;

pub(super) use sending::{TypedPhase, TypedSend, TypedSensing, TypedTransmit};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedScenario {
    pub(super) name: String,
    pub(super) loop_s: Option<f64>,
    pub(super) seed: Option<u64>,
    pub(super) map_frame: Option<String>,
    pub(super) world: TypedWorld,
    pub(super) agents: Vec<TypedAgent>,
    #[serde(default)]
    pub(super) hub: toml::Table,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum WorldKind {
    Crossing,
    Highway,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedWorld {
    pub(super) kind: WorldKind,
    pub(super) traffic: Option<f64>,
    pub(super) parked: Option<u32>,
    pub(super) works: Option<u32>,
    pub(super) pedestrians: Option<u32>,
    pub(super) bicycles: Option<u32>,
    pub(super) lanes: Option<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedAgent {
    pub(super) id: String,
    pub(super) kind: SensorKind,
    pub(super) pose: Option<TypedPose>,
    pub(super) route: Option<String>,
    pub(super) rate_hz: Option<f64>,
    pub(super) phase_ms: Option<TypedPhase>,
    #[serde(default)]
    pub(super) clock: TypedClock,
    pub(super) pose_error: Option<TypedPoseError>,
    pub(super) noise: Option<TypedNoise>,
    #[serde(default)]
    pub(super) field_of_view: TypedFieldOfView,
    pub(super) detection_probability: Option<f64>,
    pub(super) clutter_per_frame: Option<f64>,
    // Its name as long as only vehicles had it.
    #[serde(alias = "self_report", default)]
    pub(super) accuracy: TypedAccuracy,
    pub(super) sensing_ms: Option<TypedSensing>,
    pub(super) transmit: Option<TypedTransmit>,
    pub(super) send: Option<TypedSend>,
    #[serde(default)]
    pub(super) link: TypedLink,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedPose {
    pub(super) x: f64,
    pub(super) y: f64,
    #[serde(default)]
    pub(super) yaw_deg: f64,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedFieldOfView {
    pub(super) range_min_m: Option<f64>,
    pub(super) range_max_m: Option<f64>,
    pub(super) azimuth_deg: Option<f64>,
    pub(super) width_deg: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedAccuracy {
    pub(super) position_m: Option<f64>,
    pub(super) yaw_deg: Option<f64>,
    pub(super) clock_ms: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedClock {
    pub(super) offset_ms: Option<f64>,
    pub(super) drift_ppm: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedPoseError {
    pub(super) position_m: Option<f64>,
    pub(super) yaw_deg: Option<f64>,
    pub(super) correlation_s: Option<f64>,
    pub(super) bias_x_m: Option<f64>,
    pub(super) bias_y_m: Option<f64>,
    pub(super) bias_yaw_deg: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedLinkNumbers {
    pub(super) delay_ms: Option<f64>,
    pub(super) jitter_ms: Option<f64>,
    pub(super) loss: Option<f64>,
    pub(super) burst: Option<f64>,
    pub(super) rate_kbps: Option<f64>,
    pub(super) reorder: Option<bool>,
}

/// A link's name or a table. By hand as [`TypedNoise`] is.
pub(super) enum TypedLink {
    Named(LinkConfig, Option<PoseError>),
    Numbers(TypedLinkNumbers),
}

fn read_trace(path: &PathBuf) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| error.to_string())
}

impl Default for TypedLink {
    fn default() -> Self {
        Self::Named(LinkConfig::default(), None)
    }
}

impl<'de> Deserialize<'de> for TypedLink {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct LinkVisitor;
        impl<'de> Visitor<'de> for LinkVisitor {
            type Value = TypedLink;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a link such as \"lte-uu\" (see v2x links), or a table of numbers")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<TypedLink, E> {
                let link = profiles::parse(name, read_trace).map_err(E::custom)?;
                Ok(TypedLink::Named(link, profiles::pose_error(name)))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TypedLink, A::Error> {
                TypedLinkNumbers::deserialize(MapAccessDeserializer::new(map)).map(TypedLink::Numbers)
            }
        }
        deserializer.deserialize_any(LinkVisitor)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TypedNoiseNumbers {
    pub(super) position_m: f64,
    #[serde(default)]
    pub(super) position_per_m: f64,
    pub(super) yaw_deg: f64,
    #[serde(default)]
    pub(super) yaw_deg_per_m: f64,
    pub(super) size: f64,
    pub(super) size_lower: Option<f64>,
}

/// A level's name or a table. Written by hand because an untagged enum's errors name no field.
pub(super) enum TypedNoise {
    Level(NoiseLevel),
    Numbers(TypedNoiseNumbers),
}

impl<'de> Deserialize<'de> for TypedNoise {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NoiseVisitor;
        impl<'de> Visitor<'de> for NoiseVisitor {
            type Value = TypedNoise;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"N1\", \"N2\", \"N3\" or a table of numbers")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<TypedNoise, E> {
                let unknown = || E::invalid_value(serde::de::Unexpected::Str(name), &self);
                NoiseLevel::from_name(name).map(TypedNoise::Level).ok_or_else(unknown)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TypedNoise, A::Error> {
                TypedNoiseNumbers::deserialize(MapAccessDeserializer::new(map)).map(TypedNoise::Numbers)
            }
        }
        deserializer.deserialize_any(NoiseVisitor)
    }
}
