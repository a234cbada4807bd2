//! What of an agent's sending is typed as a number or a word. Visitors by hand, because an untagged enum's errors name
//! no field.

use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Unexpected, Visitor};

use super::read_trace;
use crate::link::{Delay, profiles};

/// A number of milliseconds, or `"random"`.
#[derive(Clone, Copy)]
pub(in crate::scenario) enum TypedPhase {
    Millis(f64),
    Random,
}

impl<'de> Deserialize<'de> for TypedPhase {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct PhaseVisitor;
        impl Visitor<'_> for PhaseVisitor {
            type Value = TypedPhase;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of milliseconds or \"random\"")
            }

            fn visit_f64<E: Error>(self, millis: f64) -> Result<TypedPhase, E> {
                Ok(TypedPhase::Millis(millis))
            }

            fn visit_i64<E: Error>(self, millis: i64) -> Result<TypedPhase, E> {
                Ok(TypedPhase::Millis(millis as f64))
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<TypedPhase, E> {
                if word == "random" {
                    Ok(TypedPhase::Random)
                } else {
                    Err(E::invalid_value(Unexpected::Str(word), &self))
                }
            }
        }
        deserializer.deserialize_any(PhaseVisitor)
    }
}

/// A number of milliseconds, or a delay by a link's name.
pub(in crate::scenario) enum TypedSensing {
    Millis(f64),
    Named(Delay),
}

impl<'de> Deserialize<'de> for TypedSensing {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SensingVisitor;
        impl Visitor<'_> for SensingVisitor {
            type Value = TypedSensing;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of milliseconds or a delay such as \"custom:delay=60ms,jitter=10ms\"")
            }

            fn visit_f64<E: Error>(self, millis: f64) -> Result<TypedSensing, E> {
                Ok(TypedSensing::Millis(millis))
            }

            fn visit_i64<E: Error>(self, millis: i64) -> Result<TypedSensing, E> {
                Ok(TypedSensing::Millis(millis as f64))
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<TypedSensing, E> {
                profiles::parse_delay(name, read_trace).map(TypedSensing::Named).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(SensingVisitor)
    }
}

/// `"immediately"`, or a table.
#[derive(Clone, Copy)]
pub(in crate::scenario) enum TypedTransmit {
    Immediately,
    Slotted(TypedSlots),
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TypedSlots {
    pub(in crate::scenario) period_ms: f64,
    pub(in crate::scenario) phase_ms: Option<TypedPhase>,
}

impl<'de> Deserialize<'de> for TypedTransmit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TransmitVisitor;
        impl<'de> Visitor<'de> for TransmitVisitor {
            type Value = TypedTransmit;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"immediately\" or a table { period_ms, phase_ms }")
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<TypedTransmit, E> {
                if word == "immediately" {
                    Ok(TypedTransmit::Immediately)
                } else {
                    Err(E::invalid_value(Unexpected::Str(word), &self))
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<TypedTransmit, A::Error> {
                TypedSlots::deserialize(MapAccessDeserializer::new(map)).map(TypedTransmit::Slotted)
            }
        }
        deserializer.deserialize_any(TransmitVisitor)
    }
}

/// What is sent.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(in crate::scenario) enum TypedSend {
    Periodic,
    Etsi,
}
