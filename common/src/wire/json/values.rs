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

/// A time stamp as an agent writes it: [`Micros`], or a number that is none, for an error in words.
#[derive(Clone, Copy)]
pub(super) enum Stamp {
    Micros(Timestamp),
    /// A fraction, or too large for microseconds.
    Other(f64),
}

impl Stamp {
    pub(super) const fn micros(self) -> Result<Timestamp, WireError> {
        match self {
            Self::Micros(at) => Ok(at),
            Self::Other(value) => Err(WireError::NotMicroseconds { value }),
        }
    }
}

impl Serialize for Stamp {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Micros(at) => Micros(*at).serialize(serializer),
            Self::Other(value) => serializer.serialize_f64(*value),
        }
    }
}

impl<'de> Deserialize<'de> for Stamp {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        #[expect(clippy::cast_precision_loss, reason = "only printed")]
        impl serde::de::Visitor<'_> for Visitor {
            type Value = Stamp;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("whole microseconds since 1970")
            }
            fn visit_i64<E: serde::de::Error>(self, micros: i64) -> Result<Stamp, E> {
                Ok(Timestamp::from_micros(micros).map_or(Stamp::Other(micros as f64), Stamp::Micros))
            }
            fn visit_u64<E: serde::de::Error>(self, micros: u64) -> Result<Stamp, E> {
                i64::try_from(micros).map_or(Ok(Stamp::Other(micros as f64)), |micros| self.visit_i64(micros))
            }
            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Stamp, E> {
                Ok(Stamp::Other(value))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// The words for numbers that are not finite, as Python writes them, with their values.
const NOT_FINITE: [(&str, f64); 3] =
    [("NaN", f64::NAN), ("Infinity", f64::INFINITY), ("-Infinity", f64::NEG_INFINITY)];

/// A number, or what stands for one that is not finite: `null`, as JavaScript writes it, or its name as a text.
pub(super) fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(optional_number(deserializer)?.unwrap_or(f64::NAN))
}

/// The same, where `null` says that there is no number.
pub(super) fn optional_number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    struct Visitor;
    #[expect(clippy::cast_precision_loss, reason = "as serde_json reads integers")]
    impl serde::de::Visitor<'_> for Visitor {
        type Value = Option<f64>;
        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("a number")
        }
        fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Self::Value, E> {
            Ok(Some(value))
        }
        fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Self::Value, E> {
            Ok(Some(value as f64))
        }
        fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<Self::Value, E> {
            Ok(Some(value as f64))
        }
        fn visit_unit<E: serde::de::Error>(self) -> Result<Self::Value, E> {
            Ok(None)
        }
        fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
            let word = NOT_FINITE.into_iter().find(|(word, _)| *word == text);
            word.map(|(_, value)| Some(value))
                .ok_or_else(|| E::invalid_type(serde::de::Unexpected::Str(text), &self))
        }
    }
    deserializer.deserialize_any(Visitor)
}

/// The text with bare words for numbers that are not finite as strings; `None` where it has none. Python's `json` writes
/// them, although JSON does not have them.
pub(super) fn with_quoted_words(text: &[u8]) -> Option<Vec<u8>> {
    let (mut quoted, mut is_string, mut copied, mut place) = (Vec::new(), false, 0, 0);
    while let Some(byte) = text.get(place) {
        match byte {
            b'\\' if is_string => place += 1,
            b'"' => is_string = !is_string,
            b'N' | b'I' | b'-' if !is_string => {
                let starts = |(word, _): &(&str, f64)| text[place..].starts_with(word.as_bytes());
                if let Some((word, _)) = NOT_FINITE.into_iter().find(starts) {
                    quoted.extend_from_slice(&text[copied..place]);
                    quoted.extend_from_slice(format!("\"{word}\"").as_bytes());
                    copied = place + word.len();
                    place = copied - 1;
                }
            }
            _ => {}
        }
        place += 1;
    }
    (copied > 0).then(|| [quoted.as_slice(), &text[copied..]].concat())
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

/// Any JSON, of which the caller changes a part: numbers that are not finite, as Python writes them, are texts with
/// their names, which the readers of frames understand.
///
/// # Errors
/// Where it is no JSON.
pub fn decode_value(bytes: &[u8]) -> Result<serde_json::Value, WireError> {
    parse(bytes).or_else(|error| with_quoted_words(bytes).map_or(Err(error), |quoted| parse(&quoted)))
}

pub(super) fn parse<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, WireError> {
    serde_json::from_slice(bytes).map_err(|error| match field_of(bytes, &error) {
        Some(field) => WireError::json(&format_args!("{error}, in the value of `{field}`")),
        None => WireError::json(&error),
    })
}

/// The field whose value is of the wrong kind: the last name before the place of the error.
fn field_of<'a>(bytes: &'a [u8], error: &serde_json::Error) -> Option<&'a str> {
    const LONGEST: usize = 40;
    if !error.to_string().starts_with("invalid type") {
        return None;
    }
    let line = bytes.split(|byte| *byte == b'\n').nth(error.line().checked_sub(1)?)?;
    let before = std::str::from_utf8(line.get(..error.column())?).ok()?;
    // A colon within a text has no quotation mark before it.
    let colons = before.match_indices(':').rev();
    let name = colons.into_iter().find_map(|(at, _)| before[..at].trim_end().strip_suffix('"'))?;
    let name = name.rsplit('"').next()?;
    (!name.is_empty() && name.len() <= LONGEST && !name.contains('`')).then_some(name)
}

pub(super) fn print<T: Serialize>(value: &T) -> Result<Vec<u8>, WireError> {
    serde_json::to_vec(value).map_err(|error| WireError::json(&error))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_bare_words_are_quoted() {
        let quoted =
            |text: &str| with_quoted_words(text.as_bytes()).map(|one| String::from_utf8(one).unwrap());
        assert_eq!(
            quoted(r#"{"NaN": NaN, "a\"NaN": [-Infinity,Infinity], "b": -1}"#).as_deref(),
            Some(r#"{"NaN": "NaN", "a\"NaN": ["-Infinity","Infinity"], "b": -1}"#)
        );
        assert_eq!(quoted(r#"{"NaN": 1}"#), None);
        assert_eq!(quoted("\"\\"), None, "a text that ends within a string");
    }
}
