//! The settings behind the name of a link.

use super::error::ProfileError;
use crate::link::loss::Loss;
use crate::link::transit::Outage;
use v2x_common::time::Span;

/// The settings of a link: `key=value`, separated by commas.
pub(super) struct Settings<'a> {
    name: &'a str,
    left: Vec<(&'a str, &'a str)>,
}

/// The values that a number may have, and how an error describes them.
struct Limits {
    range: std::ops::RangeInclusive<f64>,
    expected: &'static str,
}

const EXPECTED: &str = "delay, jitter, loss, burst, rate, outage, outage-every or reorder, once each";

impl<'a> Settings<'a> {
    pub(super) fn of(name: &'a str, text: &'a str) -> Result<Self, ProfileError> {
        let parts = text.split(',').map(str::trim).filter(|part| !part.is_empty());
        let pair = |part: &'a str| part.split_once('=').map(|(key, value)| (key.trim(), value.trim()));
        let left: Option<Vec<_>> = parts.map(pair).collect();
        let bare = || ProfileError::Value { key: "a setting", value: text.to_owned(), expected: "key=value" };
        Ok(Self { name, left: left.ok_or_else(bare)? })
    }

    fn take(&mut self, key: &str) -> Option<&'a str> {
        let place = self.left.iter().position(|(one, _)| *one == key)?;
        Some(self.left.remove(place).1)
    }

    pub(super) fn refused(&self, key: &str) -> ProfileError {
        ProfileError::Setting { name: self.name.to_owned(), key: key.to_owned(), expected: EXPECTED }
    }

    pub(super) fn end(self) -> Result<(), ProfileError> {
        self.left.first().map_or(Ok(()), |(key, _)| Err(self.refused(key)))
    }

    fn number(
        &mut self,
        key: &'static str,
        units: &[(&str, f64)],
        limits: Limits,
    ) -> Result<Option<f64>, ProfileError> {
        let Limits { range, expected } = limits;
        let Some(text) = self.take(key) else { return Ok(None) };
        let unit = units.iter().find(|(unit, _)| text.ends_with(unit));
        let (digits, factor) =
            unit.map_or((text, None), |(unit, factor)| (&text[..text.len() - unit.len()], Some(factor)));
        // A quantity without a unit is ambiguous.
        let factor = if units.is_empty() { Some(&1.0) } else { factor };
        let value = factor.and_then(|factor| Some(digits.trim().parse::<f64>().ok()? * factor));
        let value = value.filter(|value| range.contains(value));
        value.map(Some).ok_or_else(|| ProfileError::Value { key, value: text.to_owned(), expected })
    }

    pub(super) fn seconds(&mut self, key: &'static str) -> Result<Option<f64>, ProfileError> {
        let expected = "a time from 0 to 600 s, such as 80ms or 0.5s";
        self.number(key, &[("us", 1e-6), ("ms", 1e-3), ("s", 1.0)], Limits { range: 0.0..=600.0, expected })
    }

    pub(super) fn share(&mut self, key: &'static str) -> Result<Option<f64>, ProfileError> {
        self.number(key, &[], Limits { range: 0.0..=1.0, expected: "0 to 1" })
    }

    pub(super) fn flag(&mut self, key: &'static str) -> Result<Option<bool>, ProfileError> {
        let Some(text) = self.take(key) else { return Ok(None) };
        let expected = "true or false";
        text.parse().map(Some).map_err(|_| ProfileError::Value { key, value: text.to_owned(), expected })
    }

    pub(super) fn loss(&mut self, published: f64) -> Result<Loss, ProfileError> {
        let rate = self.share("loss")?.unwrap_or(published);
        let burst =
            self.number("burst", &[], Limits { range: 1.0..=1e6, expected: "1 to 1000000 frames" })?;
        // The mean time between bursts is at least one frame.
        if let Some(burst) = burst
            && rate < 1.0
            && rate / (burst * (1.0 - rate)) > 1.0
        {
            let expected = "at least loss / (1 - loss): shorter bursts cannot lose that much";
            return Err(ProfileError::Value { key: "burst", value: burst.to_string(), expected });
        }
        Ok(Loss { rate, burst })
    }

    pub(super) fn rate(&mut self) -> Result<Option<f64>, ProfileError> {
        let units = [("kbps", 1e3), ("Mbps", 1e6), ("Gbps", 1e9), ("bps", 1.0)];
        let expected = "a rate such as 500kbps or 6Mbps";
        self.number("rate", &units, Limits { range: 1.0..=1e12, expected })
    }

    pub(super) fn outage(&mut self) -> Result<Option<Outage>, ProfileError> {
        let (length, every) = (self.seconds("outage")?, self.seconds("outage-every")?);
        match (length, every) {
            (None, None) => Ok(None),
            (Some(length), Some(every)) if length <= every && every > 0.0 => {
                let [length, every] = [length, every].map(Span::from_secs_f64);
                Ok(Some(Outage { every, length }))
            }
            _ => Err(ProfileError::Value {
                key: "outage",
                value: length.map_or(String::new(), |length| length.to_string()),
                expected: "a time no longer than outage-every, and both",
            }),
        }
    }
}
