//! The link of an agent.

use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use super::trace::read_trace;
use crate::link::{LinkConfig, profiles};
use crate::pose_error::PoseError;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlLinkNumbers {
    pub(in crate::scenario) delay_ms: Option<f64>,
    pub(in crate::scenario) jitter_ms: Option<f64>,
    pub(in crate::scenario) loss: Option<f64>,
    pub(in crate::scenario) burst: Option<f64>,
    pub(in crate::scenario) rate_kbps: Option<f64>,
    pub(in crate::scenario) reorder: Option<bool>,
}

/// A link's name or a table. Written by hand because an untagged enum's errors name no field.
pub(in crate::scenario) enum TomlLink {
    Named(LinkConfig, Option<PoseError>),
    Numbers(TomlLinkNumbers),
}

impl Default for TomlLink {
    fn default() -> Self {
        Self::Named(LinkConfig::default(), None)
    }
}

impl<'de> Deserialize<'de> for TomlLink {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct LinkVisitor;
        impl<'de> Visitor<'de> for LinkVisitor {
            type Value = TomlLink;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a link such as \"lte-uu\" (see v2x links), or a table of numbers")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<TomlLink, E> {
                let link = profiles::parse(name, read_trace).map_err(E::custom)?;
                Ok(TomlLink::Named(link, profiles::pose_error(name)))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TomlLink, A::Error> {
                TomlLinkNumbers::deserialize(MapAccessDeserializer::new(map)).map(TomlLink::Numbers)
            }
        }
        deserializer.deserialize_any(LinkVisitor)
    }
}
