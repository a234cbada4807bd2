//! How fast an agent says that things move, against how fast they do by its own detections, whatever the directions.
//!
//! A detection that has one before it and one after it, in a straight line and at one speed, is of one object that moves. Only such ones
//! are counted: in a row of parked cars, of which each is missed at times, the nearest one is another car, but not twice in a row.

use super::observation::Observation;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::time::Span;

/// Frames so far apart are compared.
const APART: (Span, Span) = (Span::from_millis(250), Span::from_millis(900));
/// What is this fast by its places moves, m/s; nothing is faster.
const MOVING_MPS: f64 = 5.0;
const FASTEST_MPS: f64 = 45.0;
/// The next one must be so many times as far as the nearest one, and so much further, m.
const CLEAR_TIMES: f64 = 1.5;
const CLEAR_M: f64 = 2.0;
/// Both steps have one velocity within such a share of it, and this, m/s.
const STEADY_SHARE: f64 = 0.3;
const STEADY_MPS: f64 = 1.5;
/// Most detections of a frame that are looked at, and values that are kept.
const MAX_DETECTIONS: usize = 48;
const MAX_RATIOS: usize = 96;
/// Fewest values that say anything, and the share of them that is about the middle one, within such a share of it, and this.
const MIN_RATIOS: usize = 25;
const ALIKE: f64 = 0.75;
const ABOUT_SHARE: f64 = 0.35;
const ABOUT: f64 = 0.12;
/// Reported speeds are this small or this large a part of the true ones where they are wrong. Filters that lag, and detectors that see
/// only the radial part, are between.
const TOO_SLOW: f64 = 0.35;
const TOO_FAST: f64 = 1.7;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Speeds {
    before: Option<Box<DetectionFrame>>,
    last: Option<Box<DetectionFrame>>,
    /// Reported speed along the motion as a part of the speed by the places.
    ratios: Vec<f64>,
}

/// Speeds that are wrong by a factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WrongSpeeds {
    /// Reported speeds are such a part of the true ones.
    pub(super) factor: f64,
    /// Detections that were looked at.
    pub(super) n: usize,
}

impl Speeds {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        let now = seen.frame;
        if !now.detections.iter().any(|one| one.velocity.is_some()) || self.ratios.len() >= MAX_RATIOS {
            (self.before, self.last) = (None, None);
            return;
        }
        let passed = |from: &Option<Box<DetectionFrame>>| {
            from.as_ref()
                .map(|from| now.captured_at - from.captured_at)
                .filter(|passed| *passed >= Span::ZERO)
        };
        let is_near = |passed: Span| (APART.0..=APART.1).contains(&passed);
        match passed(&self.last) {
            Some(passed) if passed < APART.0 => return,
            Some(passed) if is_near(passed) => self.compare(now),
            _ => self.last = None,
        }
        self.before = self.last.replace(Box::new(now.clone()));
    }

    fn compare(&mut self, now: &DetectionFrame) {
        let (Some(before), Some(last)) = (&self.before, &self.last) else { return };
        let since_s =
            |from: &DetectionFrame, to: &DetectionFrame| (to.captured_at - from.captured_at).as_secs_f64();
        let steps_s = [since_s(before, last), since_s(last, now)];
        for one in last.detections.iter().take(MAX_DETECTIONS) {
            let Some(said) = &one.velocity else { continue };
            let was = counterpart(one, (last, before), steps_s[0]);
            let Some((was, is)) = was.zip(counterpart(one, (last, now), steps_s[1])) else { continue };
            if let Some(velocity) = steady([was, one, is].map(|one| [one.bev.x, one.bev.y]), steps_s) {
                let squared = velocity[0] * velocity[0] + velocity[1] * velocity[1];
                let along = (said.x * velocity[0] + said.y * velocity[1]) / squared;
                if along.is_finite() && self.ratios.len() < MAX_RATIOS {
                    self.ratios.push(along);
                }
            }
        }
    }

    /// `None` where they are right or scatter, or too few were seen.
    pub(super) fn wrong(&self) -> Option<WrongSpeeds> {
        let n = self.ratios.len();
        if n < MIN_RATIOS {
            return None;
        }
        let mut sorted = self.ratios.clone();
        sorted.sort_by(f64::total_cmp);
        let factor = sorted[n / 2];
        let is_about = |one: &&f64| (**one - factor).abs() <= ABOUT_SHARE * factor.abs() + ABOUT;
        let n_about = sorted.iter().filter(is_about).count();
        #[expect(clippy::cast_precision_loss, reason = "a hundred at most")]
        let are_alike = n_about as f64 >= ALIKE * n as f64;
        let is_wrong = (-ABOUT..=TOO_SLOW).contains(&factor) || factor >= TOO_FAST;
        (are_alike && is_wrong).then_some(WrongSpeeds { factor, n })
    }
}

/// The one detection of another frame that can be of the same object: the nearest, by far, and the other way round.
fn counterpart<'a>(
    one: &Detection,
    (own, other): (&DetectionFrame, &'a DetectionFrame),
    passed_s: f64,
) -> Option<&'a Detection> {
    let found = nearest(one, other, passed_s)?;
    let back = nearest(found, own, passed_s)?;
    (back.bev == one.bev).then_some(found)
}

/// The nearest detection within reach, where the next one is much further.
fn nearest<'a>(one: &Detection, among: &'a DetectionFrame, passed_s: f64) -> Option<&'a Detection> {
    let mut best: [Option<(f64, &Detection)>; 2] = [None; 2];
    for other in among.detections.iter().take(MAX_DETECTIONS) {
        let apart_m = libm::hypot(other.bev.x - one.bev.x, other.bev.y - one.bev.y);
        if best[0].is_none_or(|(least_m, _)| apart_m < least_m) {
            best = [Some((apart_m, other)), best[0]];
        } else if best[1].is_none_or(|(second_m, _)| apart_m < second_m) {
            best[1] = Some((apart_m, other));
        }
    }
    let (least_m, found) = best[0]?;
    let is_clear = best[1]
        .is_none_or(|(second_m, _)| second_m >= CLEAR_TIMES * least_m && second_m >= least_m + CLEAR_M);
    (is_clear && least_m <= FASTEST_MPS * passed_s).then_some(found)
}

/// The velocity of what was at three places, m/s; `None` of what does not move, or not steadily.
fn steady(places: [[f64; 2]; 3], steps_s: [f64; 2]) -> Option<[f64; 2]> {
    let step = |k: usize| [0, 1].map(|axis| (places[k + 1][axis] - places[k][axis]) / steps_s[k]);
    let (first, second) = (step(0), step(1));
    let whole = [0, 1].map(|axis| (places[2][axis] - places[0][axis]) / (steps_s[0] + steps_s[1]));
    let speed = libm::hypot(whole[0], whole[1]);
    let differ = libm::hypot(first[0] - second[0], first[1] - second[1]);
    (speed >= MOVING_MPS && differ <= STEADY_SHARE * speed + STEADY_MPS).then_some(whole)
}
