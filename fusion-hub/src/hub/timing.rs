//! How long the hub takes: two histograms.

use super::status::Quantiles;
use hdrhistogram::Histogram;
use v2x_common::fused::Inclusion;
use v2x_common::id::FrameId;
use v2x_common::time::{Span, Timestamp};

/// Longest span that is told apart, ns.
const LONGEST_NS: u64 = 60_000_000_000;

/// Latency (received → first fused frame put) and the part of it in which the hub worked.
#[derive(Debug)]
pub(super) struct Timing {
    latency: Histogram<u64>,
    compute: Histogram<u64>,
    /// Work on frames that no fused frame contains yet.
    handled: Vec<(FrameId, Span)>,
}

impl Timing {
    pub(super) fn new() -> Self {
        let histogram = || Histogram::new_with_max(LONGEST_NS, 3).expect("legal bounds");
        Self { latency: histogram(), compute: histogram(), handled: Vec::new() }
    }

    /// A frame was decoded and handled in this time.
    pub(super) fn note_handled(&mut self, frame: FrameId, took: Span) {
        self.handled.push((frame, took));
    }

    /// What was handled is in no fused frame that went out.
    pub(super) fn forget_handled(&mut self) {
        self.handled.clear();
    }

    /// A fused frame that is the first to contain these was put at `put_at`, after this much work.
    pub(super) fn note_published(&mut self, includes: &[Inclusion], put_at: Timestamp, took: Span) {
        for inclusion in includes {
            record(&mut self.latency, put_at - inclusion.received_at);
        }
        for (_, handling) in self.handled.drain(..) {
            record(&mut self.compute, handling + took);
        }
    }

    pub(super) fn latency_ms(&self) -> Quantiles {
        quantiles(&self.latency)
    }

    pub(super) fn compute_ms(&self) -> Quantiles {
        quantiles(&self.compute)
    }
}

fn record(histogram: &mut Histogram<u64>, span: Span) {
    histogram.saturating_record(u64::try_from(span.as_nanos()).unwrap_or(0));
}

fn quantiles(histogram: &Histogram<u64>) -> Quantiles {
    #[expect(clippy::cast_precision_loss, reason = "below a minute in ns")]
    let at =
        |quantile: f64| (!histogram.is_empty()).then(|| histogram.value_at_quantile(quantile) as f64 / 1e6);
    Quantiles { p50: at(0.50), p95: at(0.95), p99: at(0.99), max: at(1.0), count: histogram.len() }
}
