//! Publishing instants at the multiples of a tenth of a second.

use v2x_common::time::{Span, Timestamp};

/// Time between two ticks; they are at its multiples.
pub(crate) const TICK: Span = Span::from_millis(100);

/// Ticks in a row; none where the first is after the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticks {
    next: i64,
    last: i64,
}

impl Ticks {
    /// The ticks in a stretch of time, its ends included.
    pub fn within(begin: Timestamp, end: Timestamp) -> Self {
        let step = TICK.as_nanos();
        let (begin, end) = (begin.as_nanos(), end.as_nanos());
        let is_after_tick = begin.rem_euclid(step) != 0;
        Self { next: begin.div_euclid(step) + i64::from(is_after_tick), last: end.div_euclid(step) }
    }

    /// Only the ticks in a stretch of time.
    #[must_use]
    pub fn clamped_to(self, begin: Timestamp, end: Timestamp) -> Self {
        let other = Self::within(begin, end);
        Self { next: self.next.max(other.next), last: self.last.min(other.last) }
    }

    /// Number of ticks.
    pub const fn n(self) -> u64 {
        if self.last < self.next { 0 } else { (self.last - self.next).unsigned_abs() + 1 }
    }

    /// The first tick.
    pub(super) fn first(self) -> Option<Timestamp> {
        let nanos = self.next.checked_mul(TICK.as_nanos()).filter(|_| self.next <= self.last)?;
        Some(Timestamp::from_nanos(nanos))
    }
}

impl Ticks {
    /// Leaves out the ticks up to `last`, and returns them.
    pub(super) fn leave_out(&mut self, last: Timestamp) -> Option<Self> {
        let left_out = Self::within(self.first()?, last);
        self.next = self.next.max(left_out.last + 1);
        Some(left_out)
    }
}

impl Iterator for Ticks {
    type Item = Timestamp;

    fn next(&mut self) -> Option<Timestamp> {
        let first = self.first()?;
        self.next += 1;
        Some(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_of_an_interval_include_its_ends() {
        assert_eq!(Ticks::within(Timestamp::from_nanos(1), Timestamp::from_nanos(2)).n(), 0);
        assert_eq!(Ticks::within(Timestamp::EPOCH, Timestamp::EPOCH).n(), 1);
    }
}
