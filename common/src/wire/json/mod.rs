//! The JSON twin of the wire: for people, and for clients in other languages.
//!
//! Times are integer microseconds since the Unix epoch, 64-bit ids are strings, errors are standard
//! deviations. Of a detection frame only `captured_at` and each detection's `class`, `x` and `y` are
//! required; [`ReportDefaults`] fill the rest. Field names are checked: a misspelt one is an error that
//! names it. The schemas are in `common/schemas/`.

mod detections;
mod fused;
mod sensor;

pub use detections::{DecodedDetections, ReportDefaults, decode_detections, encode_detections};
pub use fused::{decode_fused, encode_fused};
pub use sensor::{decode_sensor, encode_sensor};

use super::WireError;
use crate::covariance::Covariance2;
use crate::time::Timestamp;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Microseconds since the Unix epoch.
#[derive(Clone, Copy)]
struct Micros(Timestamp);

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
struct Id64(u64);

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

fn parse<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, WireError> {
    serde_json::from_slice(bytes).map_err(|error| WireError::Json(error.to_string()))
}

fn print<T: Serialize>(value: &T) -> Result<Vec<u8>, WireError> {
    serde_json::to_vec(value).map_err(|error| WireError::Json(error.to_string()))
}

/// The variance of a standard deviation; a negative one stays negative, for validation to refuse.
fn variance(sigma: f64) -> f64 {
    sigma * sigma.abs()
}

/// A covariance of two standard deviations and a correlation.
fn covariance(sigma_a: f64, sigma_b: f64, rho: f64) -> Covariance2 {
    Covariance2 { xx: variance(sigma_a), xy: rho * sigma_a * sigma_b, yy: variance(sigma_b) }
}

/// Two standard deviations and a correlation of a covariance.
fn deviations(covariance: &Covariance2) -> (f64, f64, f64) {
    let (sigma_x, sigma_y) = (libm::sqrt(covariance.xx), libm::sqrt(covariance.yy));
    let product = sigma_x * sigma_y;
    (sigma_x, sigma_y, if product > 0.0 { covariance.xy / product } else { 0.0 })
}
