//! A prediction in steps.

use super::motion::Step;
use super::params::Params;
use super::transitions;
use crate::values::Real;
use v2x_common::class::Class;

/// Longest step in which a change of model is taken to come at its beginning, s.
const LONGEST_STEP_S: f64 = 0.25;

/// Most steps of a prediction: a longer prediction takes longer steps.
pub(super) const MOST_STEPS: f64 = 16.0;

/// A prediction in equal steps. Each step first changes models, then moves.
pub(super) struct Passage<R = f64> {
    pub(super) n_steps: u32,
    pub(super) step: Step<R>,
    /// `None` for what never changes its model.
    pub(super) transitions: Option<[[R; 4]; 4]>,
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

impl<R: Real> Passage<R> {
    /// In one step, of what changes its model and moves by these parameters.
    #[inline(always)]
    pub(super) fn short(dt_s: R, length_m: R, params: &'static Params) -> Self {
        let step = Step::of(dt_s, length_m * params.lever);
        Self { n_steps: 1, step, transitions: Some(transitions::within(step.duration_s)), params }
    }
}

/// Whether [`Passage::short`] is the whole prediction.
pub(super) fn is_short(dt_s: f64, class: Class) -> bool {
    dt_s != 0.0 && dt_s.abs() <= LONGEST_STEP_S && !class.is_immobile()
}
