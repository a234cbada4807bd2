//! How much a process computes: whoever computes for long did run.

use v2x_common::time::Span;

/// The time of processors that this process has had, between calls.
#[derive(Debug)]
pub(super) struct ProcessorTime {
    until: Span,
}

impl ProcessorTime {
    /// From now on.
    pub(super) fn begin() -> Self {
        Self { until: used() }
    }

    /// What the process has had since the last call.
    pub(super) fn take(&mut self) -> Span {
        let used = used();
        used - std::mem::replace(&mut self.until, used)
    }
}

/// What this process has had since it began: of all processors, by all threads.
pub(super) fn used() -> Span {
    let used = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Span::from_nanos(used.tv_sec.saturating_mul(1_000_000_000).saturating_add(used.tv_nsec))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_computes_has_run() {
        let mut time = ProcessorTime::begin();
        let mut most = Span::ZERO;
        // Until the clock of the process has moved.
        while most == Span::ZERO {
            most = time.take();
        }
        assert!(most > Span::ZERO);
    }
}
