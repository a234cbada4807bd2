//! Whether it is an agent's stamps that scatter, or its frames' ways: by the times between its stamps and between their arrivals.
//!
//! Let D be the time between two arrivals less that between their stamps. Where stamps scatter, D varies against the times between
//! stamps, and arrivals know nothing of it; where the link is irregular, D varies with the times between arrivals. So minus the
//! covariance of D with the times between stamps, as a part of the variance of D, is the share of the stamps. Frames that are missing,
//! and sensors that are not regular, change both times alike, and neither covariance.

use v2x_common::time::{Span, Timestamp};

/// Fewest frames that show it.
const MIN_FRAMES: u32 = 20;
/// Frames further apart say nothing: an agent was away.
const FURTHEST: Span = Span::from_millis(3_000);
/// It is the stamps that scatter where they have such a share of it.
const OF_STAMPS: f64 = 0.6;

/// Of one agent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Intervals {
    /// The stamp, the arrival and the number of the last frame.
    last: Option<(Timestamp, Timestamp, Option<u64>)>,
    n: u32,
    /// Sums of D and of the times between stamps, s; of D², and of both together, s².
    sums_s: [f64; 2],
    squares_s2: f64,
    products_s2: f64,
}

impl Intervals {
    pub(super) fn note(&mut self, captured_at: Timestamp, received_at: Timestamp, number: Option<u64>) {
        let Some((last_captured_at, last_received_at, last_number)) =
            self.last.replace((captured_at, received_at, number))
        else {
            return;
        };
        // Of frames that overtake each other the order of arrival is no order of stamps.
        let is_next = number.zip(last_number).is_none_or(|(number, last)| number > last);
        let (stamps, arrivals) = (captured_at - last_captured_at, received_at - last_received_at);
        if !is_next || stamps.abs() > FURTHEST || arrivals.abs() > FURTHEST {
            return;
        }
        let (stamps_s, d_s) = (stamps.as_secs_f64(), (arrivals - stamps).as_secs_f64());
        self.n += 1;
        self.sums_s = [self.sums_s[0] + d_s, self.sums_s[1] + stamps_s];
        self.squares_s2 += d_s * d_s;
        self.products_s2 += d_s * stamps_s;
    }

    /// By how much stamps scatter (standard deviation, s), where it is they that do, and not the link; `None` of too few frames.
    pub(super) fn scatter_of_stamps_s(&self) -> Option<f64> {
        let n = f64::from(self.n);
        if self.n < MIN_FRAMES {
            return None;
        }
        let [d_s, stamps_s] = self.sums_s.map(|sum| sum / n);
        let variance = self.squares_s2 / n - d_s * d_s;
        let of_stamps = d_s * stamps_s - self.products_s2 / n;
        // Between two stamps there are the errors of both.
        (of_stamps > 0.0 && of_stamps >= OF_STAMPS * variance).then(|| libm::sqrt(0.5 * of_stamps))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What frames show that were captured at these times and sent at once, with such errors of stamps and of ways, ms.
    fn of(captured_ms: impl Fn(i64) -> i64, errors_ms: impl Fn(i64) -> [i64; 2]) -> Option<f64> {
        let mut intervals = Intervals::default();
        for k in 0..100 {
            let at = Timestamp::EPOCH + Span::from_millis(1_000_000 + captured_ms(k));
            let [stamp_ms, way_ms] = errors_ms(k).map(Span::from_millis);
            intervals.note(at + stamp_ms, at + Span::from_millis(20) + way_ms, Some(k.unsigned_abs()));
        }
        intervals.scatter_of_stamps_s()
    }

    /// −40 to 40 ms, in no order.
    fn drawn(k: i64) -> i64 {
        (k * 7_919 + k * k * 31) % 81 - 40
    }

    #[test]
    fn stamps_that_scatter_are_told_from_links_that_do_by_what_is_even() {
        let even = |k: i64| 100 * k;
        // A sensor that leaves out frames, and one without a rate.
        let with_gaps = |k: i64| 100 * k + 300 * (k / 4);
        let uneven = |k: i64| 100 * k + drawn(3 * k + 1);
        for times in [even as fn(i64) -> i64, with_gaps, uneven] {
            let stamps = of(times, |k| [drawn(k), 0]).unwrap();
            assert!((stamps - 0.0234).abs() < 0.004, "{stamps}");
            assert_eq!(of(times, |k| [0, drawn(k)]), None);
            assert_eq!(of(times, |k| [-150, drawn(k)]), None, "a clock that is ahead, over such a link");
            assert_eq!(of(times, |_| [-150, 0]), None, "a clock that is ahead");
        }
        assert_eq!(of(even, |k| [drawn(k), 3 * drawn(k + 17)]), None, "mostly the link");
    }

    #[test]
    fn few_frames_show_nothing_of_stamps() {
        let mut intervals = Intervals::default();
        for k in 0..15 {
            let at = Timestamp::EPOCH + Span::from_millis(100 * k);
            intervals.note(at + Span::from_millis(drawn(k)), at, None);
        }
        assert_eq!(intervals.scatter_of_stamps_s(), None);
    }
}
