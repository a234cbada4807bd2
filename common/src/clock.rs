//! The clock. It is the only place that reads the operating system's time.
//!
//! A process has a timeline of its own: the system's time at its first call, and from then on a clock that nobody sets. Where the
//! system's clock is set, forward or back, by hand or by NTP, the timeline goes on, and [`step`] says how far the system's clock
//! is from it. What NTP does by changing the clock's rate changes both.

use crate::time::{Span, Timestamp};
use std::sync::LazyLock;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The same moment by both clocks.
static ANCHOR: LazyLock<(Timestamp, Instant)> = LazyLock::new(|| {
    #[expect(clippy::disallowed_methods, reason = "the only place that reads the clock")]
    let now = Instant::now();
    (system_time(), now)
});

/// The time of this process; it does not decrease, and makes no step.
pub fn now() -> Timestamp {
    let (anchored_at, instant) = *ANCHOR;
    anchored_at + span(instant.elapsed())
}

/// How far the system's clock is ahead of this process's timeline; negative where it was set back.
pub fn step() -> Span {
    // Begun before it is measured: the first call makes no step.
    let now = now();
    system_time() - now
}

fn system_time() -> Timestamp {
    #[expect(clippy::disallowed_methods, reason = "the only place that reads the clock")]
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Timestamp::EPOCH + span(since_epoch)
}

fn span(duration: Duration) -> Span {
    Span::from_nanos(i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_do_not_decrease() {
        let stamps: Vec<_> = (0..1000).map(|_| now()).collect();
        assert!(stamps.is_sorted());
    }

    #[test]
    fn without_a_fault_of_the_systems_clock_both_agree() {
        assert!(step().abs() < Span::from_millis(100), "{:?}", step());
    }
}
