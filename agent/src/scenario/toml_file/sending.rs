//! Settings of sending that are a number or a word. Visitors are written by hand because an untagged enum's errors name
//! no field.

use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Unexpected, Visitor};

use super::trace::read_trace;
use crate::link::{Delay, profiles};

/// A number of milliseconds, or `"random"`.
#[derive(Clone, Copy)]
pub(in crate::scenario) enum TomlPhase {
    Millis(f64),
    Random,
}

impl<'de> Deserialize<'de> for TomlPhase {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PhaseVisitor;
        impl Visitor<'_> for PhaseVisitor {
            type Value = TomlPhase;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of milliseconds or \"random\"")
            }

            fn visit_f64<E: Error>(self, millis: f64) -> Result<TomlPhase, E> {
                Ok(TomlPhase::Millis(millis))
            }

            fn visit_i64<E: Error>(self, millis: i64) -> Result<TomlPhase, E> {
                Ok(TomlPhase::Millis(millis as f64))
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<TomlPhase, E> {
                if word == "random" {
                    Ok(TomlPhase::Random)
                } else {
                    Err(E::invalid_value(Unexpected::Str(word), &self))
                }
            }
        }
        deserializer.deserialize_any(PhaseVisitor)
    }
}

/// A number of milliseconds, or a delay by a link's name.
pub(in crate::scenario) enum TomlSensing {
    Millis(f64),
    Named(Delay),
}

impl<'de> Deserialize<'de> for TomlSensing {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SensingVisitor;
        impl Visitor<'_> for SensingVisitor {
            type Value = TomlSensing;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of milliseconds or a delay such as \"custom:delay=60ms,jitter=10ms\"")
            }

            fn visit_f64<E: Error>(self, millis: f64) -> Result<TomlSensing, E> {
                Ok(TomlSensing::Millis(millis))
            }

            fn visit_i64<E: Error>(self, millis: i64) -> Result<TomlSensing, E> {
                Ok(TomlSensing::Millis(millis as f64))
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<TomlSensing, E> {
                profiles::parse_delay(name, read_trace).map(TomlSensing::Named).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(SensingVisitor)
    }
}

/// `"immediately"`, or a table.
#[derive(Clone, Copy)]
pub(in crate::scenario) enum TomlTransmit {
    Immediately,
    Slotted(TomlSlots),
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlSlots {
    pub(in crate::scenario) period_ms: f64,
    pub(in crate::scenario) phase_ms: Option<TomlPhase>,
}

impl<'de> Deserialize<'de> for TomlTransmit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TransmitVisitor;
        impl<'de> Visitor<'de> for TransmitVisitor {
            type Value = TomlTransmit;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"immediately\" or a table { period_ms, phase_ms }")
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<TomlTransmit, E> {
                if word == "immediately" {
                    Ok(TomlTransmit::Immediately)
                } else {
                    Err(E::invalid_value(Unexpected::Str(word), &self))
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TomlTransmit, A::Error> {
                TomlSlots::deserialize(MapAccessDeserializer::new(map)).map(TomlTransmit::Slotted)
            }
        }
        deserializer.deserialize_any(TransmitVisitor)
    }
}

/// Which detections are sent.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(in crate::scenario) enum TomlSend {
    Periodic,
    Etsi,
}
