//! The traffic light.

use v2x_common::time::Span;

/// A cycle is about this long, and fits an even number of times into the loop.
const CYCLE_S: f64 = 60.0;

/// Period of the traffic light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light {
    pub(super) cycle: Span,
    pub(super) n_cycles: u32,
}

impl Light {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "loops are at most an hour")]
    pub(super) fn new(loop_length: Span) -> Self {
        let n_pairs = libm::round(loop_length.as_secs_f64() / (2.0 * CYCLE_S)).max(1.0) as u32;
        let n_cycles = 2 * n_pairs;
        Self { cycle: Span::from_nanos(loop_length.as_nanos() / i64::from(n_cycles)), n_cycles }
    }

    pub(super) fn cycle_s(self) -> f64 {
        self.cycle.as_secs_f64()
    }

    pub(super) fn phase_s(self) -> f64 {
        self.cycle_s() / 5.0
    }

    /// When the arm's phase begins in the first cycle; phase 4 is that of bicycles and people on foot.
    pub(super) fn green_s(self, phase: u8) -> f64 {
        self.phase_s() * f64::from(phase)
    }
}
