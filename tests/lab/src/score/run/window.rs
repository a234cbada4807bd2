//! The time that is scored.

use v2x_common::time::Timestamp;

/// The time that is scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) start: Timestamp,
    pub(super) end: Timestamp,
}

impl Window {
    pub(super) fn contains(&self, at: Timestamp) -> bool {
        self.start <= at && at <= self.end
    }
}
