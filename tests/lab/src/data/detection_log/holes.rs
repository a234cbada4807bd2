//! Times of a log in which a sensor has no frame at all.

use v2x_common::time::{Span, Timestamp};

/// A hole is so long, and so many times the sensor's usual interval.
const LEAST: Span = Span::from_millis(2_000);
const INTERVALS: f64 = 8.0;
/// Fewest intervals that show what is usual.
const MIN_INTERVALS: u32 = 20;
/// Long intervals that are kept: those of the longest.
const MAX_KEPT: usize = 64;
/// Classes of intervals, each so many times the one before, from so many seconds on.
const N_CLASSES: usize = 64;
const RATIO: f64 = 1.2;
const SHORTEST_S: f64 = 1e-3;

/// Of one sensor, by its times of capture.
#[derive(Clone, Debug)]
pub(crate) struct Holes {
    latest: Timestamp,
    /// Intervals by their class.
    classes: [u32; N_CLASSES],
    n: u32,
    /// From one frame to the next one, of the long ones.
    long: Vec<(Timestamp, Timestamp)>,
}

impl Holes {
    pub(super) const fn from(at: Timestamp) -> Self {
        Self { latest: at, classes: [0; N_CLASSES], n: 0, long: Vec::new() }
    }

    pub(super) fn note(&mut self, at: Timestamp) {
        if at <= self.latest {
            self.split(at);
            return;
        }
        let passed = at - self.latest;
        self.n = self.n.saturating_add(1);
        let class = class(passed.as_secs_f64());
        self.classes[class] = self.classes[class].saturating_add(1);
        if passed >= LEAST {
            self.long.push((self.latest, at));
            if self.long.len() > MAX_KEPT {
                self.long.sort_by_key(|(from, to)| *from - *to);
                self.long.truncate(MAX_KEPT);
            }
        }
        self.latest = at;
    }

    /// A late frame ends a hole.
    fn split(&mut self, at: Timestamp) {
        if let Some(place) = self.long.iter().position(|(from, to)| *from < at && at < *to) {
            let (from, to) = self.long.swap_remove(place);
            self.long.extend([(from, at), (at, to)].into_iter().filter(|(from, to)| *to - *from >= LEAST));
        }
    }

    /// The holes, the longest first, and the usual interval, s.
    pub(crate) fn found(&self) -> (Vec<(Timestamp, Timestamp)>, f64) {
        let usual_s = self.usual_s();
        let is_hole = |(from, to): &&(Timestamp, Timestamp)| {
            self.n >= MIN_INTERVALS && (*to - *from).as_secs_f64() >= INTERVALS * usual_s
        };
        let mut holes: Vec<_> = self.long.iter().filter(is_hole).copied().collect();
        holes.sort_by_key(|(from, to)| (*from - *to, *from));
        (holes, usual_s)
    }

    /// The middle interval, s.
    fn usual_s(&self) -> f64 {
        let mut counted = 0;
        let middle = self.classes.iter().position(|n| {
            counted += n;
            2 * counted >= self.n
        });
        let class = u32::try_from(middle.unwrap_or(0)).unwrap_or(0);
        SHORTEST_S * libm::pow(RATIO, f64::from(class) + 0.5)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "within 0 and the number of classes"
)]
fn class(interval_s: f64) -> usize {
    let class = libm::log(interval_s.max(SHORTEST_S) / SHORTEST_S) / libm::log(RATIO);
    (class as usize).min(N_CLASSES - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holes(times_s: impl IntoIterator<Item = f64>) -> Vec<[f64; 2]> {
        let at = |s: f64| Timestamp::EPOCH + Span::from_secs_f64(s);
        let mut times = times_s.into_iter();
        let mut holes = Holes::from(at(times.next().unwrap()));
        times.for_each(|s| holes.note(at(s)));
        let since = |at: Timestamp| (at - Timestamp::EPOCH).as_secs_f64();
        holes.found().0.iter().map(|(from, to)| [since(*from), since(*to)]).collect()
    }

    #[test]
    fn some_seconds_without_a_frame_are_a_hole_and_lost_frames_and_slow_sensors_have_none() {
        let of =
            |is_there: fn(u32) -> bool| holes((0..400).filter(|k| is_there(*k)).map(|k| 0.1 * f64::from(k)));
        assert_eq!(of(|_| true), [[0.0; 2]; 0]);
        assert_eq!(of(|k| k % 7 != 3 && !(100..115).contains(&k)), [[0.0; 2]; 0], "a second and a half");
        let found = of(|k| !(100..160).contains(&k) && !(300..330).contains(&k));
        assert_eq!(found.len(), 2);
        assert!((found[0][0] - 9.9).abs() < 1e-6 && (found[0][1] - 16.0).abs() < 1e-6, "{found:?}");
        // A frame each two seconds, and too few to say what is usual.
        assert_eq!(holes((0..60).map(|k| 2.0 * f64::from(k))), [[0.0; 2]; 0]);
        assert_eq!(holes([0.0, 0.1, 0.2, 9.0]), [[0.0; 2]; 0]);
        // What comes late was there.
        let late = (0..100).chain(200..300).chain(100..200).map(|k| 0.1 * f64::from(k));
        assert_eq!(holes(late), [[0.0; 2]; 0]);
    }
}
