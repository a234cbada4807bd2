//! Points and spans of time, in integer nanoseconds.
//!
//! There are three times, which are not mixed: `captured_at` (time of capture by the agent's clock, not trusted),
//! `received_at` (the hub's clock) and `fused_at` (the hub time for which a fused frame is valid).
//! All are [`Timestamp`]s; the field's name says which one it is.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::{Add, AddAssign, Neg, Sub};

/// Nanoseconds since the Unix epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Timestamp(i64);

impl Timestamp {
    /// The Unix epoch itself.
    pub const EPOCH: Self = Self(0);
    /// The earliest representable time.
    pub const MIN: Self = Self(i64::MIN);
    /// The latest representable time.
    pub const MAX: Self = Self(i64::MAX);

    /// From nanoseconds since the Unix epoch.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// From microseconds since the Unix epoch, the unit of JSON; `None` beyond the year 2262.
    pub const fn from_micros(micros: i64) -> Option<Self> {
        match micros.checked_mul(1_000) {
            Some(nanos) => Some(Self(nanos)),
            None => None,
        }
    }

    /// Nanoseconds since the Unix epoch.
    #[inline]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// Whole microseconds since the Unix epoch, rounded down.
    pub const fn as_micros(self) -> i64 {
        self.0.div_euclid(1_000)
    }

    /// Rounded down to a multiple of `step` since the epoch; unchanged where `step` is not positive.
    pub const fn floor_to(self, step: Span) -> Self {
        if step.0 <= 0 {
            return self;
        }
        Self(self.0.saturating_sub(self.0.rem_euclid(step.0)))
    }
}

/// A signed difference of two [`Timestamp`]s, in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Span(i64);

impl Span {
    /// Zero.
    pub const ZERO: Self = Self(0);

    /// From nanoseconds.
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// From whole microseconds.
    pub const fn from_micros(micros: i64) -> Self {
        Self(micros.saturating_mul(1_000))
    }

    /// From whole milliseconds.
    pub const fn from_millis(millis: i64) -> Self {
        Self(millis.saturating_mul(1_000_000))
    }

    /// From seconds, rounded to the nearest nanosecond; saturates, and is zero for NaN.
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates, as documented")]
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self(libm::round(seconds * 1e9) as i64)
    }

    /// Nanoseconds.
    #[inline]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// Seconds.
    #[expect(clippy::cast_precision_loss, reason = "spans of days keep sub-microsecond precision")]
    #[inline]
    pub const fn as_secs_f64(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// Milliseconds.
    #[expect(clippy::cast_precision_loss, reason = "spans of days keep sub-microsecond precision")]
    pub const fn as_millis_f64(self) -> f64 {
        self.0 as f64 / 1e6
    }

    /// The span without its sign.
    #[inline]
    pub const fn abs(self) -> Self {
        Self(self.0.saturating_abs())
    }

    /// As a standard duration; a negative span is zero.
    pub const fn to_duration(self) -> std::time::Duration {
        std::time::Duration::from_nanos(if self.0 < 0 { 0 } else { self.0.unsigned_abs() })
    }
}

/// The unit that a number of a time since 1970 is in, as far as its size shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampUnit {
    /// Seconds.
    Seconds,
    /// Milliseconds.
    Milliseconds,
    /// Microseconds.
    Microseconds,
    /// Nanoseconds.
    Nanoseconds,
}

impl StampUnit {
    /// The unit in which this number is a time from 2001 to 2100; `None` where there is none.
    pub fn of(stamp: f64) -> Option<Self> {
        /// From September 2001 to January 2100, s.
        const PRESENT_S: std::ops::Range<f64> = 1e9..4.102e9;
        [(1.0, Self::Seconds), (1e3, Self::Milliseconds), (1e6, Self::Microseconds), (1e9, Self::Nanoseconds)]
            .into_iter()
            .find(|(per_second, _)| PRESENT_S.contains(&(stamp / per_second)))
            .map(|(_, unit)| unit)
    }

    /// Its name, such as `seconds`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }

    /// How many of it are a second.
    pub const fn per_second(self) -> u64 {
        match self {
            Self::Seconds => 1,
            Self::Milliseconds => 1_000,
            Self::Microseconds => 1_000_000,
            Self::Nanoseconds => 1_000_000_000,
        }
    }

    /// What a stamp that is no integer of microseconds seems to be, in brackets for a message; empty where its size shows
    /// nothing.
    pub(crate) fn in_words(stamp: f64) -> String {
        match Self::of(stamp) {
            Some(Self::Microseconds) => " (microseconds, but a number with a fraction)".to_owned(),
            Some(unit) => format!(" (it seems to be in {})", unit.name()),
            None => String::new(),
        }
    }
}

// Arithmetic saturates: time stamps from outside can have any value, and must not cause a panic.
impl Sub for Timestamp {
    type Output = Span;
    #[inline]
    fn sub(self, earlier: Self) -> Span {
        Span(self.0.saturating_sub(earlier.0))
    }
}

impl Add<Span> for Timestamp {
    type Output = Self;
    #[inline]
    fn add(self, span: Span) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}

impl AddAssign<Span> for Timestamp {
    fn add_assign(&mut self, span: Span) {
        *self = *self + span;
    }
}

impl Sub<Span> for Timestamp {
    type Output = Self;
    #[inline]
    fn sub(self, span: Span) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}

impl Add for Span {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Span {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Span {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl fmt::Display for Timestamp {
    /// Seconds since the Unix epoch with microseconds, for logs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let micros = self.as_micros();
        write!(f, "{}.{:06}", micros.div_euclid(1_000_000), micros.rem_euclid(1_000_000))
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} ms", self.as_millis_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_saturate_instead_of_overflowing() {
        assert_eq!(Timestamp::MAX - Timestamp::MIN, Span::from_nanos(i64::MAX));
        assert_eq!(Timestamp::MIN - Span::from_nanos(5), Timestamp::MIN);
        assert_eq!(Span::from_secs_f64(f64::NAN), Span::ZERO);
    }

    #[test]
    fn times_are_rounded_down_to_a_multiple_of_the_step_also_before_the_epoch() {
        let step = Span::from_millis(60_000);
        assert_eq!(Timestamp::from_nanos(61_000_000_000).floor_to(step).as_nanos(), 60_000_000_000);
        assert_eq!(Timestamp::from_nanos(-1).floor_to(step).as_nanos(), -60_000_000_000);
        assert_eq!(Timestamp::from_nanos(7).floor_to(Span::ZERO).as_nanos(), 7);
    }

    #[test]
    fn a_timestamp_is_printed_in_seconds_with_microseconds() {
        assert_eq!(Timestamp::from_nanos(1_500_000_001).to_string(), "1.500000");
        assert_eq!(Span::from_micros(1500).to_string(), "1.500 ms");
    }

    #[test]
    fn the_unit_of_a_stamp_of_the_present_is_known_by_its_size() {
        for (stamp, unit) in [
            (1.795e9, Some(StampUnit::Seconds)),
            (1.795e12, Some(StampUnit::Milliseconds)),
            (1.795e15, Some(StampUnit::Microseconds)),
            (1.795e18, Some(StampUnit::Nanoseconds)),
            (12.5, None),
            (5e9, None),
            (-1.795e9, None),
            (f64::NAN, None),
        ] {
            assert_eq!(StampUnit::of(stamp), unit, "{stamp}");
        }
    }
}
