//! Spans of time since the start, counted by how long they were: what a monitoring system makes quantiles of.

use v2x_common::time::Span;

/// Ends of the classes, s. Lists are wanted within tens of milliseconds.
const ENDS_S: [f64; 14] = [0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0];

/// Counts that never fall.
#[derive(Clone, Debug, Default)]
pub struct SpanCounts {
    counts: [u64; ENDS_S.len() + 1],
    sum_s: f64,
}

impl SpanCounts {
    pub(super) fn note(&mut self, span: Span) {
        let seconds = span.as_secs_f64().max(0.0);
        let class = ENDS_S.iter().position(|end| seconds <= *end).unwrap_or(ENDS_S.len());
        self.counts[class] += 1;
        self.sum_s += seconds;
    }

    /// The end of each class in s, the last one infinite, and how many spans were in it.
    pub fn classes(&self) -> impl Iterator<Item = (f64, u64)> {
        ENDS_S.into_iter().chain([f64::INFINITY]).zip(self.counts)
    }

    /// How many were counted.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// All of them together, s.
    pub const fn sum_s(&self) -> f64 {
        self.sum_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_span_is_in_the_first_class_that_holds_it() {
        let mut spans = SpanCounts::default();
        [0, 5, 6, 60_000, -1].into_iter().for_each(|ms| spans.note(Span::from_millis(ms)));
        let filled: Vec<_> = spans.classes().filter(|(_, count)| *count > 0).collect();
        assert_eq!(filled, [(0.0005, 2), (0.005, 1), (0.01, 1), (f64::INFINITY, 1)]);
        assert_eq!((spans.count(), spans.sum_s()), (5, 60.011));
    }
}
