//! Whether an agent's frames are two streams in turn, which nothing but their contents and times shows: minimal JSON has
//! neither an epoch nor a sequence number.
//!
//! A frame that resembles the last but one and not the last one is a *return*. Noise, flickering objects and jitter make
//! frames that resemble the last one and not the last but one as often, and what moves makes more of those. So only the excess
//! of returns counts.

use super::observation::Observation;
use std::collections::VecDeque;
use v2x_common::time::{Span, Timestamp};

/// Frames before the newest one with which it is compared.
const N_BEFORE: usize = 3;
/// Frames of more objects are not compared: it would cost too much.
const MAX_PLACES: usize = 48;
/// Frames that are further apart are not compared: in a column of vehicles each is where the one ahead was. No column has a
/// headway of so little.
const WITHIN: Span = Span::from_millis(600);
/// Objects without a counterpart count as so far from it, m.
const FAR_M: f64 = 20.0;
/// What is called different is so far apart at least, m and s, and so many times as far as what is called alike.
const DIFFERENT_M: f64 = 1.0;
const DIFFERENT_S: f64 = 0.02;
const TIMES: f64 = 3.0;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Streams {
    before: VecDeque<Seen>,
    /// Frames that had three before them, not too long ago.
    pub(super) compared: u64,
    contents: Turns,
    delays: Turns,
    /// Frames that were captured before the one that came before them.
    pub(super) backwards: u64,
}

/// A frame.
#[derive(Clone, Debug)]
struct Seen {
    captured_at: Timestamp,
    delay_s: f64,
    /// `None` of too many.
    places: Option<Vec<[f64; 2]>>,
}

/// How often something returned after one other frame, and after one or two, each less how often the reverse happened.
#[derive(Clone, Copy, Debug, Default)]
struct Turns {
    after_one: i64,
    after_two: i64,
}

impl Turns {
    /// Takes in how different a frame is from the last one, the last but one, and the one before that.
    fn note(&mut self, [one, two, three]: [f64; N_BEFORE], least: f64) {
        let is_other = |far: f64, near: f64| far >= least && far >= TIMES * near;
        self.after_one += i64::from(is_other(one, two)) - i64::from(is_other(two, one));
        self.after_two += i64::from(is_other(one, two.min(three))) - i64::from(is_other(three, one.min(two)));
    }

    fn excess(&self) -> u64 {
        u64::try_from(self.after_one.max(self.after_two)).unwrap_or(0)
    }
}

impl Streams {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let frame = seen.frame;
        let places = frame.detections.iter().map(|one| [one.bev.x, one.bev.y]);
        let seen = Seen {
            captured_at: frame.captured_at,
            delay_s: (seen.received_at - frame.captured_at).as_secs_f64(),
            places: (frame.detections.len() <= MAX_PLACES).then(|| places.collect()),
        };
        if let [three, two, one] = self.before.make_contiguous() {
            let before = [&*one, &*two, &*three];
            if before.iter().all(|other| (seen.captured_at - other.captured_at).abs() <= WITHIN) {
                self.compared += 1;
                self.backwards += u64::from(seen.captured_at < before[0].captured_at);
                self.delays.note(before.map(|other| (seen.delay_s - other.delay_s).abs()), DIFFERENT_S);
                if let [Some(one), Some(two), Some(three)] = before.map(|other| seen.distance_m(other)) {
                    self.contents.note([one, two, three], DIFFERENT_M);
                }
            }
            self.before.pop_front();
        }
        self.before.push_back(seen);
    }

    /// How many frames show again what the last but one showed (or the one before that), and the last one did not.
    pub(super) fn content_returns(&self) -> u64 {
        self.contents.excess()
    }

    /// The same of the time that frames have taken.
    pub(super) fn delay_returns(&self) -> u64 {
        self.delays.excess()
    }
}

impl Seen {
    /// How far their objects are from each other in the mean, m; `None` where there are too many.
    #[expect(clippy::cast_precision_loss, reason = "some hundred objects at most")]
    fn distance_m(&self, other: &Self) -> Option<f64> {
        let (these, those) = (self.places.as_ref()?, other.places.as_ref()?);
        let n = these.len() + those.len();
        let sum = to_nearest_m(these, those) + to_nearest_m(those, these);
        Some(if n == 0 { 0.0 } else { sum / n as f64 })
    }
}

fn to_nearest_m(from: &[[f64; 2]], to: &[[f64; 2]]) -> f64 {
    let nearest = |[x, y]: &[f64; 2]| {
        let squares = to.iter().map(|[px, py]| (px - x) * (px - x) + (py - y) * (py - y));
        libm::sqrt(squares.fold(FAR_M * FAR_M, f64::min))
    };
    from.iter().map(nearest).sum()
}
