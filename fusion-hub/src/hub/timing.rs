//! How long the hub takes: histograms of the last minute.

use super::span_counts::SpanCounts;
use super::status::Quantiles;
use hdrhistogram::Histogram;
use v2x_common::fused::Inclusion;
use v2x_common::id::FrameId;
use v2x_common::time::{Span, Timestamp};

/// Longest span that is distinguished, ns.
const LONGEST_NS: u64 = 60_000_000_000;
/// Duration of each of two histograms: quantiles cover the last half minute to a minute.
const HALF_WINDOW: Span = Span::from_millis(30_000);

/// Latency (received → first fused frame put) and the part of it in which the hub worked.
#[derive(Debug)]
pub(super) struct Timing {
    latency: RecentSpans,
    compute: RecentSpans,
    publish: RecentSpans,
    /// Work on frames that no fused frame contains yet.
    handled: Vec<(FrameId, Span)>,
}

impl Timing {
    pub(super) fn new() -> Self {
        Self {
            latency: RecentSpans::new(),
            compute: RecentSpans::new(),
            publish: RecentSpans::new(),
            handled: Vec::new(),
        }
    }

    /// A frame was decoded and handled in this time.
    pub(super) fn note_handled(&mut self, frame: FrameId, took: Span) {
        self.handled.push((frame, took));
    }

    /// The handled frames are in no published fused frame.
    pub(super) fn forget_handled(&mut self) {
        self.handled.clear();
    }

    /// A fused frame that is the first to contain these was put at `put_at`, after this much work.
    pub(super) fn note_published(&mut self, includes: &[Inclusion], put_at: Timestamp, took: Span) {
        for inclusion in includes {
            self.latency.note(put_at - inclusion.received_at, put_at);
        }
        for (_, handling) in self.handled.drain(..) {
            self.compute.note(handling + took, put_at);
        }
    }

    /// A fused frame took from `begun_at` to `ended_at` to be made and put.
    pub(super) fn note_cost(&mut self, begun_at: Timestamp, ended_at: Timestamp) {
        self.publish.note(ended_at - begun_at, ended_at);
    }

    /// Since the start: latency, compute, publish.
    pub(super) fn totals(&self) -> [SpanCounts; 3] {
        [&self.latency, &self.compute, &self.publish].map(|spans| spans.total.clone())
    }

    pub(super) fn publish_ms(&self) -> Quantiles {
        self.publish.quantiles_ms()
    }

    pub(super) fn latency_ms(&self) -> Quantiles {
        self.latency.quantiles_ms()
    }

    pub(super) fn compute_ms(&self) -> Quantiles {
        self.compute.quantiles_ms()
    }
}

/// Spans of the last minute: older values do not hide new ones.
#[derive(Debug)]
struct RecentSpans {
    current: Histogram<u64>,
    previous: Histogram<u64>,
    /// Of all time.
    total: SpanCounts,
    began_at: Option<Timestamp>,
}

impl RecentSpans {
    fn new() -> Self {
        let histogram = || Histogram::new_with_max(LONGEST_NS, 3).expect("legal bounds");
        Self { current: histogram(), previous: histogram(), total: SpanCounts::default(), began_at: None }
    }

    fn note(&mut self, span: Span, now: Timestamp) {
        self.total.note(span);
        let age = now - *self.began_at.get_or_insert(now);
        if age >= HALF_WINDOW {
            std::mem::swap(&mut self.current, &mut self.previous);
            self.current.reset();
            if age >= HALF_WINDOW + HALF_WINDOW {
                self.previous.reset();
            }
            self.began_at = Some(now);
        }
        self.current.saturating_record(u64::try_from(span.as_nanos()).unwrap_or(0));
    }

    fn quantiles_ms(&self) -> Quantiles {
        let mut all = self.current.clone();
        // Histograms of the same bounds can always be added.
        let _ = all.add(&self.previous);
        #[expect(clippy::cast_precision_loss, reason = "below a minute in ns")]
        let at = |quantile: f64| (!all.is_empty()).then(|| all.value_at_quantile(quantile) as f64 / 1e6);
        Quantiles { p50: at(0.50), p95: at(0.95), p99: at(0.99), max: at(1.0), count: all.len() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_cover_the_last_minute_only() {
        let mut spans = RecentSpans::new();
        let start = Timestamp::EPOCH + Span::from_millis(1_000_000);
        let second = |k: i64| start + Span::from_millis(1000 * k);
        (0..86_400).for_each(|k| spans.note(Span::from_millis(1), second(k)));
        (86_400..86_460).for_each(|k| spans.note(Span::from_millis(50), second(k)));
        let quantiles = spans.quantiles_ms();
        assert!(quantiles.p50.is_some_and(|p50| p50 > 45.0), "{quantiles:?}");
        assert!(quantiles.count <= 60, "{quantiles:?}");
    }
}
