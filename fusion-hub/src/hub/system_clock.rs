//! Whether somebody has set the system's clock.

use v2x_common::time::Span;

/// A step of the system's clock from which on it is one; less is how exactly two clocks are read.
const NOTED: Span = Span::from_millis(20);

/// How far the system's clock is ahead of the hub's timeline.
#[derive(Debug)]
pub(super) struct SystemClock {
    /// Reads that.
    read: fn() -> Span,
    /// What was noted last.
    pub(super) step: Span,
}

impl SystemClock {
    pub(super) const fn new(read: fn() -> Span) -> Self {
        Self { read, step: Span::ZERO }
    }

    /// How far it is ahead, and what is to be said, where it was set since the last call.
    pub(super) fn was_set(&mut self) -> Option<(Span, String)> {
        let by = self.was_set_by()?;
        Some((self.step, words(by, self.step)))
    }

    fn was_set_by(&mut self) -> Option<Span> {
        let step = (self.read)();
        let by = step - self.step;
        (by.abs() >= NOTED).then(|| {
            self.step = step;
            by
        })
    }
}

/// What is said of a clock that was set `by` so much, and is so far ahead since.
fn words(by: Span, step: Span) -> String {
    format!(
        "the system's clock was set by {:.0} ms: this hub's stamps go on as before, {:.0} ms off it, until it is started again; \
         agents are understood by either clock",
        by.as_millis_f64(),
        -step.as_millis_f64()
    )
}

#[cfg(all(test, feature = "cli"))]
mod tests {
    use super::*;
    use crate::engine::Engine;
    use crate::hub::monitor::{Monitor, Snapshot};
    use crate::hub::monitoring::exported;
    use crate::hub::run::{HubSetup, serve_by};
    use crate::hub::settings::HubSettings;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicI64, Ordering};
    use std::time::Duration;
    use tokio_util::sync::CancellationToken;
    use v2x_common::id::NetworkId;
    use v2x_common::net::session::SessionOptions;

    /// Time limit on a busy machine.
    const PATIENCE: Duration = Duration::from_secs(60);

    #[test]
    fn a_fault_of_the_system_clock_is_reported_once_with_its_step_and_smaller_ones_are_not() {
        static STEP_US: AtomicI64 = AtomicI64::new(0);
        let mut clock = SystemClock::new(|| Span::from_micros(STEP_US.load(Ordering::Relaxed)));
        let mut set_to = |ms: i64| {
            STEP_US.store(1000 * ms, Ordering::Relaxed);
            clock.was_set_by()
        };
        assert_eq!((set_to(0), set_to(19)), (None, None));
        assert_eq!(set_to(5000), Some(Span::from_millis(5000)));
        assert_eq!((set_to(5000), set_to(5019)), (None, None));
        assert_eq!(set_to(-3_600_000), Some(Span::from_millis(-3_605_000)));
        let words = words(Span::from_millis(-3_605_000), Span::from_millis(-3_600_000));
        assert!(words.contains("set by -3605000 ms") && words.contains("3600000 ms off it"), "{words}");
    }

    /// The first state of a running hub that fulfils a condition.
    async fn shown(monitor: &Monitor, is_so: impl Fn(&Snapshot) -> bool) -> Arc<Snapshot> {
        let found = async {
            loop {
                if let Some(newest) = monitor.newest().filter(|newest| is_so(newest)) {
                    return newest;
                }
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        };
        tokio::time::timeout(PATIENCE, found).await.expect("it is shown in time")
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_fault_of_the_system_clock_is_in_the_status_and_the_metrics_of_a_running_hub_whose_time_goes_on()
     {
        static STEP_US: AtomicI64 = AtomicI64::new(0);
        let monitor = Monitor::default();
        let setup = HubSetup {
            network: NetworkId::new("clock-step").unwrap(),
            settings: HubSettings::default(),
            session: SessionOptions {
                listen: vec!["tcp/127.0.0.1:0".to_owned()],
                ..SessionOptions::default()
            },
            record: None,
            monitor: Some(monitor.clone()),
            began_again: 0,
        };
        let shutdown = CancellationToken::new();
        let read = || Span::from_micros(STEP_US.load(Ordering::Relaxed));
        let hub = tokio::spawn(serve_by(setup, shutdown.clone(), Engine::new, |_, _| {}, read));
        let before = shown(&monitor, |newest| newest.status.frames_published > 0).await;
        assert!(before.status.clock_step_ms.abs() < 1e-9);
        for step in [5_000, -3_600_000].map(Span::from_millis) {
            STEP_US.store(step.as_nanos() / 1000, Ordering::Relaxed);
            let step_ms = step.as_millis_f64();
            let after = shown(&monitor, |newest| {
                newest.status.clock_step_ms.abs() > 1e-9
                    && newest.status.clock_step_ms.is_sign_negative() == (step_ms < 0.0)
            })
            .await;
            assert!((after.status.clock_step_ms - step_ms).abs() < 1e-9);
            assert!((0..60_000_000).contains(&(after.status.now - before.status.now)), "its time goes on");
            let metrics = exported::exposition(&monitor).unwrap().unwrap();
            let line = format!("v2x_hub_clock_step_seconds {}", step_ms / 1e3);
            assert!(metrics.contains(&line), "{line} in {metrics}");
        }
        shutdown.cancel();
        assert!(hub.await.unwrap().is_ok());
    }
}
