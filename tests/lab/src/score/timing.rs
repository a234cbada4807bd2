//! End-to-end latency and age of information at the consumer.

use crate::data::run_log::ReceivedFused;
use crate::score::percentiles::Percentiles;
use v2x_common::time::{Span, Timestamp};

/// Step of the samples of the age of information.
pub(crate) const AGE_STEP: Span = Span::from_millis(10);

/// Of longer times samples are further apart, so that there are so many at most.
const MOST_SAMPLES: i64 = 1_000_000;

/// From a measurement's capture until the consumer receives the first fused frame that contains it, ms, over every
/// detection frame in the `includes` of the given fused frames.
pub(crate) fn end_to_end_ms<'a>(fused: impl IntoIterator<Item = &'a ReceivedFused>) -> Option<Percentiles> {
    Percentiles::of(end_to_end_spans_ms(fused))
}

/// The spans themselves.
pub(crate) fn end_to_end_spans_ms<'a>(fused: impl IntoIterator<Item = &'a ReceivedFused>) -> Vec<f64> {
    let spans = fused.into_iter().flat_map(|received| {
        received.frame.includes.iter().map(|included| millis(received.received_at - included.captured_at))
    });
    spans.collect()
}

/// From a frame's arrival at the hub until the consumer has the first fused frame that contains it, ms.
pub(crate) fn arrival_to_consumer_spans_ms<'a>(
    fused: impl IntoIterator<Item = &'a ReceivedFused>,
) -> Vec<f64> {
    let spans = fused.into_iter().flat_map(|received| {
        received.frame.includes.iter().map(|included| millis(received.received_at - included.received_at))
    });
    spans.collect()
}

/// Age of the newest measurement at the consumer, ms: at every 10 ms from `start` to `end` the time less the newest
/// `captured_at`, of any agent, contained in any fused frame received so far. Times before the first measurement are
/// left out.
pub(crate) fn age_of_information_ms(
    fused: &[ReceivedFused],
    start: Timestamp,
    end: Timestamp,
) -> Option<Percentiles> {
    Percentiles::of(ages_ms(fused, start, end))
}

/// The samples themselves.
pub(crate) fn ages_ms(fused: &[ReceivedFused], start: Timestamp, end: Timestamp) -> Vec<f64> {
    let mut ages = Vec::new();
    let mut arrivals: Vec<_> = fused.iter().collect();
    arrivals.sort_by_key(|received| received.received_at);
    let mut arrivals = arrivals.into_iter().peekable();
    let mut newest = None;
    let step = AGE_STEP.max(Span::from_nanos((end - start).as_nanos() / MOST_SAMPLES));
    let mut at = start;
    while at <= end {
        while let Some(received) = arrivals.next_if(|received| received.received_at <= at) {
            newest = newest.max(received.frame.includes.iter().map(|included| included.captured_at).max());
        }
        ages.extend(newest.map(|newest| millis(at - newest)));
        at += step;
    }
    ages
}

/// Divided, not multiplied by 1e-6, so that 30 ms print as 30.
#[expect(clippy::cast_precision_loss, reason = "spans of days keep sub-microsecond precision")]
fn millis(span: Span) -> f64 {
    span.as_nanos() as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::{at_ms, fused};

    #[test]
    fn end_to_end_runs_from_capture_to_the_consumer_for_every_included_frame() {
        let log = [fused(130, 125, &[100, 90]), fused(140, 139, &[]), fused(220, 212, &[200])];
        let spans = end_to_end_ms(&log).unwrap();
        assert_eq!((spans.p50, spans.p99), (30.0, 40.0));
        assert_eq!(end_to_end_ms(&log[1..2]), None);
    }

    #[test]
    fn age_grows_until_a_newer_frame_arrives() {
        // Ages: at 100: 30; 110: 40; 120: 50 becomes 15 on arrival; 130: 25; an older one changes nothing.
        let log = [fused(80, 75, &[70]), fused(120, 118, &[105]), fused(125, 124, &[60])];
        let ages = age_of_information_ms(&log, at_ms(100), at_ms(130)).unwrap();
        assert_eq!((ages.p50, ages.p95), (25.0, 40.0));
    }

    #[test]
    fn before_the_first_measurement_there_is_no_age() {
        let log = [fused(120, 118, &[105])];
        assert_eq!(age_of_information_ms(&log, at_ms(100), at_ms(119)), None);
        assert_eq!(age_of_information_ms(&log, at_ms(100), at_ms(120)).unwrap().p99, 15.0);
    }
}
