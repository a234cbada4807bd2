//! How fast an agent says that things move, against how fast they do by its own detections, whatever the directions.
//!
//! Only detections that have one before them and one after them, in a straight line and at one speed, are counted ([`steps`]).

use super::observation::Observation;
use super::steps;
use v2x_common::detection::DetectionFrame;
use v2x_common::time::Span;

/// Frames so far apart are compared.
const APART: (Span, Span) = (Span::from_millis(250), Span::from_millis(900));
/// What is this fast by its places moves, m/s.
const MOVING_MPS: f64 = 5.0;
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
        let (Some(before), Some(last)) = (self.before.as_deref(), self.last.as_deref()) else { return };
        let since_s =
            |from: &DetectionFrame, to: &DetectionFrame| (to.captured_at - from.captured_at).as_secs_f64();
        let steps_s = [since_s(before, last), since_s(last, now)];
        let places = [before, last, now].map(places);
        for (k, one) in last.detections.iter().enumerate().take(MAX_DETECTIONS) {
            let Some(said) = &one.velocity else { continue };
            let velocity = steps::velocity(k, places.each_ref().map(|one| &one[..]), steps_s);
            let Some(velocity) = velocity.filter(|[x, y]| libm::hypot(*x, *y) >= MOVING_MPS) else {
                continue;
            };
            let squared = velocity[0] * velocity[0] + velocity[1] * velocity[1];
            let along = (said.x * velocity[0] + said.y * velocity[1]) / squared;
            if along.is_finite() && self.ratios.len() < MAX_RATIOS {
                self.ratios.push(along);
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

/// Where its detections are, m.
fn places(frame: &DetectionFrame) -> Vec<[f64; 2]> {
    frame.detections.iter().take(MAX_DETECTIONS).map(|one| [one.bev.x, one.bev.y]).collect()
}
