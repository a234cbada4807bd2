//! A prediction in steps.

use super::motion::Step;
use super::params::Params;
use super::transitions;
use v2x_common::class::Class;

/// Longest step in which a change of model is taken to come at its beginning, s.
const LONGEST_STEP_S: f64 = 0.25;

/// Most steps of a prediction: a longer prediction takes longer steps.
pub(super) const MOST_STEPS: f64 = 16.0;

/// A prediction in equal steps. Each step first changes models, then moves.
pub(super) struct Passage {
    pub(super) n_steps: u32,
    pub(super) step: Step,
    /// `None` for what never changes its model.
    pub(super) transitions: Option<[[f64; 4]; 4]>,
    pub(super) params: &'static Params,
}

impl Passage {
    #[inline(always)]
    pub(super) fn of(dt_s: f64, class: Class, length_m: f64) -> Self {
        let params = Params::of(class);
        let steps = libm::ceil(dt_s.abs() / LONGEST_STEP_S).clamp(1.0, MOST_STEPS);
        let step = Step::of(dt_s / steps, params.lever * length_m);
        let transitions = (!class.is_immobile()).then(|| transitions::within(step.duration_s));
        Self { n_steps: steps as u32, step, transitions, params }
    }
}
