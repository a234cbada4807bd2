//! When frames may be sent.

use v2x_common::time::Span;

/// Opportunities to send: at `phase` plus any whole number of periods, also a negative one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slots {
    /// Time between two opportunities; positive.
    pub(super) period: Span,
    /// Time of one of them, since the scenario's start.
    pub(super) phase: Span,
}

impl Slots {
    /// The first opportunity that is not before `ready` (since the scenario's start).
    pub(super) fn at_or_after(&self, ready: Span) -> Span {
        let wait = (self.phase - ready).as_nanos().rem_euclid(self.period.as_nanos().max(1));
        ready + Span::from_nanos(wait)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ready_frame_waits_for_the_next_slot() {
        let slots = Slots { period: Span::from_millis(100), phase: Span::from_millis(30) };
        let at = |ms: i64| slots.at_or_after(Span::from_millis(ms)).as_millis_f64();
        assert_eq!((at(0), at(30), at(31), at(129), at(130)), (30.0, 30.0, 130.0, 130.0, 130.0));
        assert_eq!((at(-71), at(-70)), (-70.0, -70.0));
    }
}
