//! What a hub says of itself to whoever is not on its network: a supervisor, a load balancer, a monitoring system.

use super::health::Verdict;
use super::span_counts::SpanCounts;
use super::status::HubStatus;
use std::sync::{Arc, Mutex, PoisonError};
use v2x_common::time::{Span, Timestamp};

/// A hub shows itself every second: one that has not for so long takes no steps.
const STANDS_AFTER: Span = Span::from_millis(5_000);
/// While its session is opened anew it shows itself only then.
const JOINS_WITHIN: Span = Span::from_millis(60_000);
/// Lists are missed after so many of the longest time between two, and not earlier than [`MISSED_AFTER`].
const MISSED_LISTS: i64 = 3;
const MISSED_AFTER: Span = Span::from_millis(2_500);

/// Where a hub shows itself twice a second. Clones are the same place.
#[derive(Clone, Debug, Default)]
pub struct Monitor(Arc<Mutex<Option<Arc<Snapshot>>>>);

impl Monitor {
    pub(super) fn show(&self, snapshot: Snapshot) {
        // A replaced pointer is whole, whoever panicked.
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(snapshot));
    }

    /// What it showed last; `None` before it is ready.
    pub fn newest(&self) -> Option<Arc<Snapshot>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A hub at one moment.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Its status.
    pub status: HubStatus,
    /// Frame received → first list put that contains it, since the start.
    pub latency: SpanCounts,
    /// The part of it in which the hub worked.
    pub compute: SpanCounts,
    /// What lists took to be made and put.
    pub publish: SpanCounts,
    /// Pairs of a detection and a track that were weighed.
    pub candidates: u64,
    /// When it was shown, by the hub's clock.
    pub shown_at: Timestamp,
    /// Whether its session is open.
    pub is_joined: bool,
    /// When its newest list was put, or that came which it follows.
    pub listed_at: Option<Timestamp>,
    /// The longest time between two lists that its settings mean.
    pub list_interval: Span,
}

impl Snapshot {
    /// Why it should be started again, if so.
    pub fn not_live(&self, now: Timestamp) -> Option<String> {
        let stands = now - self.shown_at;
        let patience = if self.is_joined { STANDS_AFTER } else { JOINS_WITHIN };
        (stands >= patience).then(|| format!("the hub took no step for {:.1} s", stands.as_secs_f64()))
    }

    /// Why nobody should be sent to it now, if so.
    pub fn not_ready(&self, now: Timestamp) -> Option<String> {
        if let Some(reason) = self.not_live(now) {
            return Some(reason);
        }
        if !self.is_joined {
            return Some("its session is being opened anew".to_owned());
        }
        let Some(listed_at) = self.listed_at else {
            return Some("no list has been published yet".to_owned());
        };
        let since = now - listed_at;
        let patience = MISSED_AFTER.max(Span::from_nanos(MISSED_LISTS * self.list_interval.as_nanos()));
        (since >= patience).then(|| format!("no list was published for {:.1} s", since.as_secs_f64()))
    }

    /// All that is wrong: with itself, or with what its agents send; nothing where all is well.
    pub fn not_healthy(&self, now: Timestamp) -> Vec<String> {
        let mut reasons: Vec<_> = self.not_ready(now).into_iter().collect();
        if !self.status.agents.iter().any(|agent| agent.alive) {
            reasons.push("no agent is alive".to_owned());
        }
        if self.status.verdict == Verdict::Degraded {
            let faults = self.status.findings.iter().filter(|finding| finding.is_fault());
            reasons.extend(faults.map(ToString::to_string));
        }
        reasons
    }
}
