//! The clock. It is the only place that reads the operating system's time.

use crate::time::Timestamp;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

static LATEST: AtomicI64 = AtomicI64::new(i64::MIN);

/// The system's time, monotonic within one process: where the system's clock is set back, the value stays the same
/// until the system's clock has reached it again.
pub fn now() -> Timestamp {
    #[expect(clippy::disallowed_methods, reason = "the only place that reads the clock")]
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let nanos = i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX);
    Timestamp::from_nanos(nanos.max(LATEST.fetch_max(nanos, Ordering::Relaxed)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_do_not_decrease() {
        let stamps: Vec<_> = (0..1000).map(|_| now()).collect();
        assert!(stamps.is_sorted());
    }
}
