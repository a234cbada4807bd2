//! Values that the JSON payloads have in common.

use crate::covariance::Covariance2;
use crate::time::Timestamp;
use crate::wire::error::WireError;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Microseconds since the Unix epoch.
#[derive(Clone, Copy)]
pub(super) struct Micros(pub(super) Timestamp);

impl Serialize for Micros {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i64(self.0.as_micros())
    }
}

impl<'de> Deserialize<'de> for Micros {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let micros = i64::deserialize(deserializer)?;
        let out_of_range = || serde::de::Error::custom(format_args!("time {micros} µs is out of range"));
        Timestamp::from_micros(micros).map(Self).ok_or_else(out_of_range)
    }
}

/// A 64-bit number: a string, since a JSON number keeps 53 bits in many languages; small plain numbers
/// are accepted.
#[derive(Clone, Copy)]
pub(super) struct Id64(pub(super) u64);

impl Serialize for Id64 {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&self.0)
    }
}

impl<'de> Deserialize<'de> for Id64 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = Id64;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an unsigned 64-bit number, as a string or as a number")
            }
            fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<Id64, E> {
                Ok(Id64(value))
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Id64, E> {
                let invalid = || E::invalid_value(serde::de::Unexpected::Str(text), &self);
                text.parse().map(Id64).map_err(|_| invalid())
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

pub(super) fn parse<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, WireError> {
    serde_json::from_slice(bytes).map_err(|error| WireError::Json(error.to_string()))
}

pub(super) fn print<T: Serialize>(value: &T) -> Result<Vec<u8>, WireError> {
    serde_json::to_vec(value).map_err(|error| WireError::Json(error.to_string()))
}

/// The variance of a standard deviation; a negative one stays negative, for validation to refuse.
pub(super) fn variance(sigma: f64) -> f64 {
    sigma * sigma.abs()
}

/// A covariance of two standard deviations and a correlation.
pub(super) fn covariance(sigma_a: f64, sigma_b: f64, rho: f64) -> Covariance2 {
    Covariance2 { xx: variance(sigma_a), xy: rho * sigma_a * sigma_b, yy: variance(sigma_b) }
}

/// Two standard deviations and a correlation of a covariance.
pub(super) fn deviations(covariance: &Covariance2) -> (f64, f64, f64) {
    let (sigma_x, sigma_y) = (libm::sqrt(covariance.xx), libm::sqrt(covariance.yy));
    let product = sigma_x * sigma_y;
    (sigma_x, sigma_y, if product > 0.0 { covariance.xy / product } else { 0.0 })
}
