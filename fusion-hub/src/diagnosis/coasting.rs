//! Whether an agent sends on what it has lost, and lets it drive on: then what scattered from frame to frame goes exactly straight, at
//! exactly one speed, for seconds.
//!
//! Exact reports do so, too, as a simulation's: but they have never scattered. A tracker may predict what it has missed for a moment.

use super::observation::Observation;
use super::stale::drives;
use v2x_common::time::{Span, Timestamp};

/// Objects that are followed, for how long without a detection, and detections of a frame that are looked at.
const MAX_THREADS: usize = 24;
const FOLLOWED: Span = Span::from_millis(400);
const MAX_DETECTIONS: usize = 24;
/// Frames so far apart show how something moves.
const APART: (Span, Span) = (Span::from_millis(20), Span::from_millis(300));
/// Where the one before leads to, to rounding, m; and as near as its next detection is.
const EXACT_M: f64 = 2e-3;
const NEAR_M: f64 = 2.0;
/// Times between frames that differ by such a share are alike.
const SAME_STEP: f64 = 1e-6;
/// No vehicle changes its velocity so, m/s²: positions scatter, in so many of the last eight steps.
const SCATTERS_MPS2: f64 = 15.0;
const MIN_SCATTERED: u32 = 3;
/// What drives, m/s, and goes on for so long exactly.
const DRIVES_MPS: f64 = 2.0;
const GOES_ON: Span = Span::from_millis(3_000);

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Coasting {
    threads: Vec<Thread>,
    last_at: Option<Timestamp>,
    /// Objects that did so, and detections of these.
    pub(super) objects: u64,
    pub(super) detections: u64,
}

/// One object.
#[derive(Clone, Copy, Debug)]
struct Thread {
    at: Timestamp,
    place: [f64; 2],
    /// Its last step, m, and how long that took, s.
    step: Option<([f64; 2], f64)>,
    /// Whether each of the last steps scattered, the newest in the lowest bit.
    scattered: u8,
    /// Since when it goes exactly, where it scattered before.
    exact_since: Option<Timestamp>,
    is_counted: bool,
}

impl Coasting {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let now = seen.frame.captured_at;
        let passed = self.last_at.map(|at| now - at);
        // Late frames and parts of one.
        if passed.is_some_and(|passed| passed <= Span::ZERO && passed > Span::ZERO - FOLLOWED) {
            return;
        }
        self.last_at = Some(now);
        if !passed.is_some_and(|passed| passed >= APART.0 && passed <= APART.1) {
            self.threads.clear();
        }
        self.threads.retain(|thread| now - thread.at <= FOLLOWED);
        let (mut all, mut met) = (std::mem::take(&mut self.threads), Vec::new());
        // Of a list in the order of its tracks the newest are followed: the others may have been lost before.
        let places = seen.frame.detections.iter().rev().filter(|one| drives(one)).take(MAX_DETECTIONS);
        let mut others: Vec<_> = places.map(|one| [one.bev.x, one.bev.y]).collect();
        others.retain(|place| {
            let off_m2 = all.iter().map(|thread| thread.off_m2(*place, now)).enumerate();
            let nearest = off_m2.min_by(|(_, a), (_, b)| a.total_cmp(b));
            let Some((found, _)) = nearest.filter(|(_, off_m2)| *off_m2 <= NEAR_M * NEAR_M) else {
                return true;
            };
            met.push((all.swap_remove(found), *place));
            false
        });
        for (thread, place) in met {
            let thread = self.went_on(thread, place, now);
            self.threads.push(thread);
        }
        // What was not met may have been missed.
        self.threads.append(&mut all);
        self.threads.extend(others.into_iter().map(|place| Thread::new(place, now)));
        self.threads.truncate(MAX_THREADS);
    }

    fn went_on(&mut self, thread: Thread, place: [f64; 2], now: Timestamp) -> Thread {
        let took_s = (now - thread.at).as_secs_f64();
        let step = [0, 1].map(|k| place[k] - thread.place[k]);
        let mut next = Thread { at: now, place, step: Some((step, took_s)), ..thread };
        let Some((before, before_s)) = thread.step else { return next };
        let is_exact = thread.off_m2(place, now) <= EXACT_M * EXACT_M;
        let change = [0, 1].map(|k| step[k] / took_s - before[k] / before_s);
        let scatters = libm::hypot(change[0], change[1]) > SCATTERS_MPS2 * took_s;
        next.scattered = (thread.scattered << 1) | u8::from(scatters);
        if !is_exact {
            (next.exact_since, next.is_counted) = (None, false);
        } else if thread.exact_since.is_none() && thread.scattered.count_ones() >= MIN_SCATTERED {
            next.exact_since = Some(thread.at);
        }
        let drives = libm::hypot(step[0], step[1]) >= DRIVES_MPS * took_s;
        if drives && next.exact_since.is_some_and(|since| now - since >= GOES_ON) {
            self.detections += 1;
            self.objects += u64::from(!std::mem::replace(&mut next.is_counted, true));
        }
        next
    }
}

impl Thread {
    const fn new(place: [f64; 2], at: Timestamp) -> Self {
        Self { at, place, step: None, scattered: 0, exact_since: None, is_counted: false }
    }

    /// How far a place is from where it leads to, at one speed or with one step a frame, m².
    fn off_m2(&self, place: [f64; 2], now: Timestamp) -> f64 {
        let step = self.step.map_or([0.0; 2], |(step, _)| step);
        let off = |by: f64| {
            let [x, y] = [0, 1].map(|k| place[k] - self.place[k] - by * step[k]);
            x * x + y * y
        };
        let by = self.step.map_or(1.0, |(_, took_s)| (now - self.at).as_secs_f64() / took_s);
        let with_one_step = off(1.0);
        if (by - 1.0).abs() < SAME_STEP { with_one_step } else { with_one_step.min(off(by)) }
    }
}
