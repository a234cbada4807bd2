//! How fast what an agent sees moves by its own numbers, against how fast anything of its class does: in another unit of length everything
//! is too fast, also where nobody else sees the same.
//!
//! Only detections that have one before them and one after them, in a straight line and at one speed, are counted ([`steps`]): which
//! one is which is told by distances that all grow with the unit.

use super::observation::Observation;
use super::steps;
use v2x_common::class::{Class, ClassGroup};
use v2x_common::time::{Span, Timestamp};

/// Frames so far apart are compared.
const APART: (Span, Span) = (Span::from_millis(250), Span::from_millis(900));
/// Most detections of a frame that are looked at, and values that are kept.
const MAX_DETECTIONS: usize = 24;
const MAX_RATIOS: usize = 128;
/// Frames of a window that are compared.
const MAX_COMPARED: u32 = 24;
/// Fewest values that say anything, and how many times as many as those of a possible speed there are.
const MIN_FAST: usize = 25;
const TIMES: usize = 2;
/// Of a possible speed is what is faster than such a part of the usual one of its class: the rest may stand.
const MOVES: f64 = 0.3;
/// What is no place any more, m/s.
const ANY_MPS: f64 = 1e6;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Paces {
    before: Option<Seen>,
    last: Option<Seen>,
    /// Too fast: speeds, and as parts of the usual ones.
    fast: Vec<[f64; 2]>,
    possible: usize,
    compared: u32,
}

#[derive(Clone, Debug)]
struct Seen {
    at: Timestamp,
    places: Vec<[f64; 2]>,
    classes: Vec<Class>,
}

/// Speeds that nothing has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WrongPaces {
    /// The middle one, m/s.
    pub(super) speed_mps: f64,
    /// So many times as fast as usual, in the middle.
    pub(super) factor: f64,
    pub(super) n: usize,
}

/// How fast things of a group usually are, and how fast none is, m/s.
const fn speeds(group: ClassGroup) -> Option<[f64; 2]> {
    match group {
        ClassGroup::Pedestrian => Some([1.4, 12.0]),
        ClassGroup::TwoWheeled => Some([5.0, 50.0]),
        ClassGroup::FourWheeled | ClassGroup::Unknown => Some([10.0, 65.0]),
        ClassGroup::Immobile => None,
    }
}

impl Paces {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        if self.fast.len() + self.possible >= MAX_RATIOS || self.compared >= MAX_COMPARED {
            return;
        }
        let now = seen.frame.captured_at;
        let passed = |from: &Option<Seen>| from.as_ref().map(|from| now - from.at);
        match passed(&self.last) {
            Some(passed) if passed >= Span::ZERO && passed < APART.0 => {}
            Some(passed) if passed >= APART.0 && passed <= APART.1 => {
                let now = Seen::of(seen);
                self.compare(&now);
                self.before = self.last.replace(now);
            }
            _ => (self.before, self.last) = (None, Some(Seen::of(seen))),
        }
    }

    fn compare(&mut self, now: &Seen) {
        let (Some(before), Some(last)) = (&self.before, &self.last) else { return };
        self.compared += 1;
        let steps_s = [last.at - before.at, now.at - last.at].map(Span::as_secs_f64);
        let frames = [before, last, now].map(|one| &one.places[..]);
        for (k, class) in last.classes.iter().enumerate() {
            let Some([usual, fastest]) = speeds(class.group()) else { continue };
            let Some([x, y]) = steps::velocity_up_to(ANY_MPS, k, frames, steps_s) else { continue };
            let speed_mps = libm::hypot(x, y);
            if speed_mps > fastest {
                self.fast.push([speed_mps, speed_mps / usual]);
            } else if speed_mps > MOVES * usual {
                self.possible += 1;
            }
        }
    }

    /// `None` where they are possible, or too few move.
    pub(super) fn wrong(&self) -> Option<WrongPaces> {
        let n = self.fast.len();
        if n < MIN_FAST || n < TIMES * self.possible {
            return None;
        }
        let [speed_mps, factor] = [0, 1].map(|which| {
            let mut sorted: Vec<_> = self.fast.iter().map(|one| one[which]).collect();
            sorted.sort_by(f64::total_cmp);
            sorted[n / 2]
        });
        Some(WrongPaces { speed_mps, factor, n })
    }
}

impl Seen {
    fn of(seen: &Observation<'_>) -> Self {
        let looked_at = || seen.frame.detections.iter().take(MAX_DETECTIONS);
        Self {
            at: seen.frame.captured_at,
            places: looked_at().map(|one| [one.bev.x, one.bev.y]).collect(),
            classes: looked_at().map(|one| one.class).collect(),
        }
    }
}
