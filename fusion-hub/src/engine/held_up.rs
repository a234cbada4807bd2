//! A while in which the hub did not run: stopped by a signal, or by a system that had no time for it.

use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// After that the world is another one.
const AT_MOST: Span = Span::from_millis(30_000);
/// What is still there is reported again within this time.
const REPORTED_AGAIN_WITHIN: Span = Span::from_millis(1_500);

/// Such a while, not long ago.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct HeldUp {
    lasted: Span,
    /// Tracks of before are kept until then.
    until: Timestamp,
}

impl HeldUp {
    /// It ended at `now`.
    pub(super) fn new(now: Timestamp, lasted: Span) -> Self {
        Self { lasted: lasted.clamp(Span::ZERO, AT_MOST), until: now + REPORTED_AGAIN_WITHIN }
    }

    /// How much longer tracks are kept at `now` than without it.
    pub(super) fn keeps(self, now: Timestamp) -> Span {
        if now <= self.until { self.lasted } else { Span::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracks_are_kept_longer_by_what_it_lasted_and_only_until_agents_had_time_to_report() {
        let at = |ms| Timestamp::EPOCH + Span::from_millis(ms);
        let held_up = HeldUp::new(at(5_000), Span::from_millis(4_000));
        assert_eq!(held_up.keeps(at(6_500)), Span::from_millis(4_000));
        assert_eq!(held_up.keeps(at(6_501)), Span::ZERO);
        assert_eq!(HeldUp::new(at(0), Span::from_millis(-1)).keeps(at(0)), Span::ZERO);
        assert_eq!(HeldUp::new(at(0), Span::from_millis(3_600_000)).keeps(at(0)), AT_MOST);
    }
}
