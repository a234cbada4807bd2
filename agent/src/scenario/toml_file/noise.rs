//! The measurement noise of an agent.

use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use crate::noise::NoiseLevel;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlNoiseNumbers {
    pub(in crate::scenario) position_m: f64,
    #[serde(default)]
    pub(in crate::scenario) position_per_m: f64,
    pub(in crate::scenario) yaw_deg: f64,
    #[serde(default)]
    pub(in crate::scenario) yaw_deg_per_m: f64,
    pub(in crate::scenario) size: f64,
    pub(in crate::scenario) size_lower: Option<f64>,
}

/// A level's name or a table. Written by hand because an untagged enum's errors name no field.
pub(in crate::scenario) enum TomlNoise {
    Level(NoiseLevel),
    Numbers(TomlNoiseNumbers),
}

impl<'de> Deserialize<'de> for TomlNoise {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NoiseVisitor;
        impl<'de> Visitor<'de> for NoiseVisitor {
            type Value = TomlNoise;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"N1\", \"N2\", \"N3\" or a table of numbers")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<TomlNoise, E> {
                let unknown = || E::invalid_value(serde::de::Unexpected::Str(name), &self);
                NoiseLevel::from_name(name).map(TomlNoise::Level).ok_or_else(unknown)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TomlNoise, A::Error> {
                TomlNoiseNumbers::deserialize(MapAccessDeserializer::new(map)).map(TomlNoise::Numbers)
            }
        }
        deserializer.deserialize_any(NoiseVisitor)
    }
}
