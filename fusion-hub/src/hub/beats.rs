//! Says that this hub publishes, to one that stands by for it: from a thread of its own, so that it is on time while the hub's
//! loop makes a list that takes long; as long as that loop takes steps.

use crate::standby::Beat;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;
use v2x_common::clock;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::ENCODING_JSON;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

/// The time between two.
const EVERY: Duration = Duration::from_millis(50);
/// A loop that has taken no step for so long does not publish.
const STEPS_WITHIN: Span = Span::from_millis(2_000);

/// What says that a hub publishes.
pub(super) struct Beats {
    state: Arc<State>,
    // The thread ends when this is dropped.
    _ends: Sender<()>,
}

#[derive(Debug, Default)]
struct State {
    publishes: AtomicBool,
    /// Lists published so far.
    sequence: AtomicU64,
    /// When the loop took its last step, ns.
    stepped_at: AtomicI64,
}

impl State {
    /// Whether it is to be said at `now`.
    fn is_due(&self, now: Timestamp) -> bool {
        let stepped_at = Timestamp::from_nanos(self.stepped_at.load(Ordering::Relaxed));
        self.publishes.load(Ordering::Relaxed) && now - stepped_at < STEPS_WITHIN
    }
}

impl Beats {
    /// Of a hub of this lineage, with such settings; it does not publish yet.
    pub(super) async fn declare(
        session: &Session,
        key: String,
        (lineage, settings): (u32, u64),
    ) -> zenoh::Result<Self> {
        let publisher = session.declare_publisher(key).encoding(ENCODING_JSON);
        let publisher =
            publisher.congestion_control(CongestionControl::Drop).priority(Priority::InteractiveHigh);
        let publisher = publisher.express(true).await?;
        let (ends, end) = channel::<()>();
        let state = Arc::new(State::default());
        let shared = state.clone();
        std::thread::spawn(move || {
            while end.recv_timeout(EVERY) == Err(RecvTimeoutError::Timeout) {
                let now = clock::now();
                if !shared.is_due(now) {
                    continue;
                }
                let beat = Beat::new(lineage, settings, shared.sequence.load(Ordering::Relaxed), now);
                if let Err(error) = publisher.put(beat.encode()).wait() {
                    tracing::debug!(%error, "not said that this hub publishes");
                }
            }
        });
        Ok(Self { state, _ends: ends })
    }

    /// The hub's loop takes a step.
    pub(super) fn note_step(&self, publishes: bool, sequence: u64, now: Timestamp) {
        self.state.publishes.store(publishes, Ordering::Relaxed);
        self.state.sequence.store(sequence, Ordering::Relaxed);
        self.state.stepped_at.store(now.as_nanos(), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standby_hears_nothing_of_a_hub_that_does_not_publish_or_takes_no_steps() {
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        let (state, (ends, _end)) = (Arc::new(State::default()), channel());
        let beats = Beats { state: state.clone(), _ends: ends };
        beats.note_step(false, 0, at(0));
        assert!(!state.is_due(at(0)));
        beats.note_step(true, 0, at(100));
        assert!(state.is_due(at(1900)), "a list that takes long");
        assert!(!state.is_due(at(2100)), "the loop is stuck");
    }
}
