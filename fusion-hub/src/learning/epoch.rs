//! Epochs of capture time.

use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// Length of an epoch.
pub(super) const EPOCH: Span = Span::from_millis(250);

/// A number of an epoch, counted from the epoch of all time stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) struct Epoch(i64);

impl Epoch {
    /// The epoch that a time is in.
    pub(super) const fn of(at: Timestamp) -> Self {
        Self(at.as_nanos().div_euclid(EPOCH.as_nanos()))
    }

    /// Its begin.
    pub(super) const fn begin(self) -> Timestamp {
        Timestamp::from_nanos(self.0.saturating_mul(EPOCH.as_nanos()))
    }

    /// The one after it.
    pub(super) const fn next(self) -> Self {
        Self(self.0 + 1)
    }

    /// Whether it is the turn of what began in an epoch: one in so many.
    pub(super) const fn is_turn(self, of: Self, one_in: i64) -> bool {
        self.0.wrapping_sub(of.0).rem_euclid(one_in) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_before_and_after_zero_are_in_the_epoch_that_begins_before_them() {
        for ns in [-1, 0, 249_999_999, 250_000_000, -250_000_001] {
            let (at, epoch) = (Timestamp::from_nanos(ns), Epoch::of(Timestamp::from_nanos(ns)));
            assert!(epoch.begin() <= at && at < epoch.next().begin());
        }
    }
}
