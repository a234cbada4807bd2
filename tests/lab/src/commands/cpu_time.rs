//! Computing time.

use rustix::time::{ClockId, clock_gettime};
use v2x_common::time::Span;

/// CPU time that this thread has used.
pub(crate) fn thread_cpu_time() -> Span {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Span::from_nanos(time.tv_sec * 1_000_000_000 + time.tv_nsec)
}
