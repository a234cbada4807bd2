//! How far an agent's positions scatter from one frame to the next, by themselves: about the middle between the places before and
//! after. What is learnt by fusing is bounded; this is not. Errors that last for seconds do not show in it.

use super::observation::Observation;
use super::steps;
use v2x_common::time::{Span, Timestamp};

/// Frames no further apart are compared: what brakes or turns is off by centimetres then.
const APART: Span = Span::from_millis(220);
/// Most detections of a frame that are looked at, values that are kept, and fewest that say anything.
const MAX_DETECTIONS: usize = 24;
/// Frames of a window that are compared.
const MAX_COMPARED: u32 = 40;
const MAX_VALUES: usize = 400;
const MIN_VALUES: usize = 80;
/// The middle of the magnitudes of normal errors, as a part of their standard deviation.
const MIDDLE: f64 = 0.674_489_750_196_081_7;
/// Less is of reports without errors, m.
const LEAST_M: f64 = 1e-3;

/// Of one agent.
#[derive(Clone, Debug, Default)]
pub(super) struct Scatter {
    before: Option<(Timestamp, Vec<[f64; 2]>)>,
    last: Option<(Timestamp, Vec<[f64; 2]>)>,
    /// Magnitudes along the axes, m, as of one position.
    values: Vec<f64>,
    compared: u32,
}

impl Scatter {
    pub(super) fn note(&mut self, seen: &Observation<'_>) {
        if self.values.len() >= MAX_VALUES || self.compared >= MAX_COMPARED {
            return;
        }
        let places = seen.frame.detections.iter().take(MAX_DETECTIONS).map(|one| [one.bev.x, one.bev.y]);
        let now = (seen.frame.captured_at, places.collect::<Vec<_>>());
        self.compare(&now);
        self.before = self.last.replace(now);
    }

    fn compare(&mut self, now: &(Timestamp, Vec<[f64; 2]>)) {
        let (Some(before), Some(last)) = (&self.before, &self.last) else { return };
        let steps = [last.0 - before.0, now.0 - last.0];
        if !steps.iter().all(|step| *step > Span::ZERO && *step <= APART) {
            return;
        }
        self.compared += 1;
        let steps_s = steps.map(Span::as_secs_f64);
        let shares = steps_s.map(|step_s| step_s / (steps_s[0] + steps_s[1]));
        // Of the middle between two others.
        let size = libm::sqrt(1.0 + shares[0] * shares[0] + shares[1] * shares[1]);
        let frames = [&before.1[..], &last.1, &now.1];
        for k in 0..last.1.len() {
            let Some([was, is]) = steps::counterparts(k, frames, steps_s) else { continue };
            let middle = |axis: usize| before.1[was][axis] * shares[1] + now.1[is][axis] * shares[0];
            self.values.extend([0, 1].map(|axis| (last.1[k][axis] - middle(axis)).abs() / size));
        }
    }

    /// The standard deviation along an axis, m; `None` of reports without errors, or where too little was seen.
    pub(super) fn sigma_m(&self) -> Option<f64> {
        if self.values.len() < MIN_VALUES {
            return None;
        }
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        let sigma_m = sorted[sorted.len() / 2] / MIDDLE;
        (sigma_m >= LEAST_M).then_some(sigma_m)
    }
}
