//! The one clock. Nothing else in the project asks the operating system for the time.

use crate::time::Timestamp;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

static LATEST: AtomicI64 = AtomicI64::new(i64::MIN);

/// The system's time, which within one process never runs backwards: where the system's clock is set
/// back, the clock stands until it has caught up.
pub fn now() -> Timestamp {
    #[expect(clippy::disallowed_methods, reason = "this is the one clock")]
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let nanos = i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX);
    Timestamp::from_nanos(nanos.max(LATEST.fetch_max(nanos, Ordering::Relaxed)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_never_go_backwards() {
        let stamps: Vec<_> = (0..1000).map(|_| now()).collect();
        assert!(stamps.is_sorted());
    }
}
