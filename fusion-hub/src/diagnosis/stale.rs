//! Whether an agent sends on what it has lost: then what drives stands still from one frame to the next, to the last digit, and stays.
//!
//! No vehicle stops so. Exact reports of what stands repeat, too, as a simulation's do: but that slows down before, or was at its place all
//! the time. A tracker may keep what it has lost for a moment.

use super::observation::Observation;
use std::collections::BTreeMap;
use v2x_common::class::{Class, ClassGroup};
use v2x_common::detection::Detection;
use v2x_common::time::{Span, Timestamp};

/// Places that are remembered, for how long, and detections of a frame that are looked at.
const MAX_PLACES: usize = 1_024;
const REMEMBERED: Span = Span::from_millis(1_000);
const MAX_DETECTIONS: usize = 24;
/// Places are looked through this often.
const PRUNED: Span = Span::from_millis(500);
/// Frames so far apart show how fast something was.
const APART: (Span, Span) = (Span::from_millis(20), Span::from_millis(300));
/// What was so fast drove, m/s.
const DROVE_MPS: (f64, f64) = (5.0, 60.0);
/// What is there so long, and in so many frames, was not only missed for a moment.
const STAYS: Span = Span::from_millis(1_700);
const MIN_FRAMES: u32 = 6;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Stale {
    places: BTreeMap<[u64; 2], Place>,
    /// Places that are new in the last frame.
    new: Vec<([f64; 2], Class)>,
    last_at: Option<Timestamp>,
    pruned_at: Option<Timestamp>,
    /// Objects that drove and then stood for ever, and detections that say so.
    pub(super) objects: u64,
    pub(super) detections: u64,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    first: Timestamp,
    last: Timestamp,
    frames: u32,
    /// When it came there, it drove.
    drove: bool,
    is_counted: bool,
}

impl Stale {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let now = seen.frame.captured_at;
        let passed = self.last_at.map(|at| now - at);
        // Late frames and parts of one.
        if passed.is_some_and(|passed| passed <= Span::ZERO && passed > Span::ZERO - REMEMBERED) {
            return;
        }
        self.last_at = Some(now);
        let passed = passed.filter(|passed| *passed >= APART.0 && *passed <= APART.1);
        if self.pruned_at.is_none_or(|at| (now - at).abs() >= PRUNED) {
            self.places.retain(|_, place| (now - place.last).abs() <= REMEMBERED);
            self.pruned_at = Some(now);
        }
        let before = std::mem::take(&mut self.new);
        for one in seen.frame.detections.iter().rev().filter(|one| drives(one)).take(MAX_DETECTIONS) {
            let at = [one.bev.x, one.bev.y];
            let key = at.map(f64::to_bits);
            if let Some(place) = self.places.get_mut(&key) {
                (place.last, place.frames) = (now, place.frames + 1);
                if place.drove && now - place.first >= STAYS && place.frames >= MIN_FRAMES {
                    self.detections += 1;
                    self.objects += u64::from(!std::mem::replace(&mut place.is_counted, true));
                }
            } else if self.places.len() < MAX_PLACES {
                let drove = passed.is_some_and(|passed| came_driving(one, at, &before, passed));
                let place = Place { first: now, last: now, frames: 1, drove, is_counted: false };
                self.places.insert(key, place);
                self.new.push((at, one.class));
            }
        }
    }
}

/// Whether the nearest place of its class that was new in the last frame is as far away as something that drives.
fn came_driving(one: &Detection, at: [f64; 2], before: &[([f64; 2], Class)], passed: Span) -> bool {
    let same = before.iter().filter(|(_, class)| *class == one.class);
    let apart = same.map(|(was, _)| libm::hypot(at[0] - was[0], at[1] - was[1]));
    let speed_mps = apart.min_by(f64::total_cmp).map(|apart_m| apart_m / passed.as_secs_f64());
    speed_mps.is_some_and(|speed| (DROVE_MPS.0..=DROVE_MPS.1).contains(&speed))
}

/// Whether it is of something that may drive.
pub(super) fn drives(one: &Detection) -> bool {
    matches!(one.class.group(), ClassGroup::FourWheeled | ClassGroup::TwoWheeled | ClassGroup::Unknown)
}
