//! The unit that the times of a sensor seem to be in. Where they count from 1970 their size shows it
//! ([`StampUnit::of`]); in other epochs the times between frames do.

use v2x_common::time::{Span, StampUnit, Timestamp};

/// A sensor sends a frame more often than this, s. A fiftieth of a second is as much in milliseconds.
const LONGEST_INTERVAL_S: f64 = 20.0;
/// Fewest intervals that show a unit.
const MIN_INTERVALS: u64 = 4;
/// Both times go on alike, but for their units and this factor.
const TOLERANCE: f64 = 2.0;
const UNITS: [StampUnit; 4] =
    [StampUnit::Seconds, StampUnit::Milliseconds, StampUnit::Microseconds, StampUnit::Nanoseconds];
/// Of two neighbours of these.
const RATIO: f64 = 1000.0;
/// Times of capture over times of arrival, by how many places in [`UNITS`] they are finer.
const RATIOS: [(isize, f64); 7] =
    [(-3, 1e-9), (-2, 1e-6), (-1, 1e-3), (0, 1.0), (1, 1e3), (2, 1e6), (3, 1e9)];

/// How one of the times of a sensor goes on from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Progress {
    first: Timestamp,
    last: Timestamp,
    newest: Timestamp,
    /// Intervals other than zero, by the place in [`UNITS`] in which they are those of a sensor.
    intervals: [u64; 4],
}

impl Progress {
    /// Before the first frame has been noted.
    pub(super) const fn from(at: Timestamp) -> Self {
        Self { first: at, last: at, newest: at, intervals: [0; 4] }
    }

    pub(super) fn note(&mut self, at: Timestamp) {
        let interval_s = (at - self.newest).as_secs_f64().abs();
        self.newest = at;
        self.first = self.first.min(at);
        self.last = self.last.max(at);
        if interval_s > 0.0 {
            let mut longest_s = LONGEST_INTERVAL_S;
            let mut place = 0;
            while interval_s >= longest_s && place < UNITS.len() - 1 {
                longest_s *= RATIO;
                place += 1;
            }
            self.intervals[place] += 1;
        }
    }

    pub(super) fn span(&self) -> Span {
        self.last - self.first
    }

    /// The place in [`UNITS`] of the median interval. A log may have gaps of days.
    fn place(&self) -> Option<usize> {
        let all: u64 = self.intervals.iter().sum();
        let mut below = 0;
        let is_median = |n: &u64| {
            below += n;
            2 * below > all
        };
        if all < MIN_INTERVALS { None } else { self.intervals.iter().position(is_median) }
    }
}

/// The units of the two times of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TimeUnits {
    /// Of the capture.
    pub captured: StampUnit,
    /// Of the arrival.
    pub received: StampUnit,
}

impl TimeUnits {
    /// `None` where both are seconds, or the times do not show it.
    pub(super) fn of(captures: &Progress, arrivals: &Progress) -> Option<Self> {
        let [captured_s, received_s] = [captures, arrivals].map(|one| one.span().as_secs_f64());
        let is_it = |(_, ratio): &(isize, f64)| {
            (TOLERANCE.recip()..=TOLERANCE).contains(&(captured_s / received_s / ratio))
        };
        let (steps, _) = RATIOS.into_iter().find(is_it)?;
        // The coarser of the two is what a sensor's intervals show best.
        let finer = steps.unsigned_abs();
        let coarse = if steps >= 0 { arrivals.place() } else { captures.place() };
        // Many frames may arrive at one time.
        let coarse = coarse.or_else(|| captures.place().filter(|_| steps == 0))?;
        let fine = *UNITS.get(coarse + finer)?;
        let coarse = UNITS[coarse];
        let (captured, received) = if steps >= 0 { (fine, coarse) } else { (coarse, fine) };
        (fine != StampUnit::Seconds).then_some(Self { captured, received })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sixty frames of a sensor, with the seconds between two captures and between two arrivals.
    fn units(capture_s: f64, arrival_s: f64) -> Option<TimeUnits> {
        let [mut captures, mut arrivals] = [Progress::from(Timestamp::EPOCH); 2];
        for k in 0..60 {
            let at = |interval_s: f64| Timestamp::EPOCH + Span::from_secs_f64(interval_s * f64::from(k));
            captures.note(at(capture_s));
            // Jitter.
            arrivals.note(at(arrival_s) + Span::from_secs_f64(arrival_s * 0.3 * f64::from(k % 3)));
        }
        TimeUnits::of(&captures, &arrivals)
    }

    #[test]
    fn times_in_seconds_are_in_seconds_at_any_rate_of_a_sensor() {
        for interval_s in [0.01, 0.1, 2.0, 15.0] {
            assert_eq!(units(interval_s, interval_s), None, "{interval_s}");
        }
        assert_eq!(units(0.1, 0.0), None, "all arrive at one time");
        assert_eq!(units(0.1, 0.7), None, "a clock that is wrong is in no other unit");
    }

    #[test]
    fn each_column_in_another_unit_is_found() {
        use StampUnit::{Microseconds, Milliseconds, Nanoseconds, Seconds};
        for (capture_s, arrival_s, captured, received) in [
            (100.0, 0.1, Milliseconds, Seconds),
            (1e5, 0.1, Microseconds, Seconds),
            (1e8, 0.1, Nanoseconds, Seconds),
            (0.1, 100.0, Seconds, Milliseconds),
            (100.0, 100.0, Milliseconds, Milliseconds),
            (1e5, 1e5, Microseconds, Microseconds),
            (1e8, 1e8, Nanoseconds, Nanoseconds),
            (1e5, 100.0, Microseconds, Milliseconds),
        ] {
            let expected = Some(TimeUnits { captured, received });
            assert_eq!(units(capture_s, arrival_s), expected, "{capture_s} {arrival_s}");
        }
    }

    #[test]
    fn a_gap_of_a_day_shows_no_other_unit() {
        let mut progress = Progress::from(Timestamp::EPOCH);
        for k in 0..20 {
            let day = if k < 10 { 0.0 } else { 86_400.0 };
            progress.note(Timestamp::EPOCH + Span::from_secs_f64(day + 0.1 * f64::from(k)));
        }
        assert_eq!(TimeUnits::of(&progress, &progress), None);
    }
}
