//! An agent's clock: what it shows at a true time.

use v2x_common::time::Span;

/// How a clock errs. It shows true time + offset + drift · (time since the scenario's start).
///
/// Only stamps are made by it. When an agent captures and sends is true time, so that an experiment with a wrong
/// clock sees the same world, and differs in its stamps alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockError {
    /// How far it was ahead at the scenario's start.
    pub offset: Span,
    /// How much faster it runs than it should, parts per million.
    pub drift_ppm: f64,
}

impl ClockError {
    /// How far the clock is ahead at this true time since the scenario's start.
    pub fn at(&self, since_start: Span) -> Span {
        self.offset + Span::from_secs_f64(1e-6 * self.drift_ppm * since_start.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_grows_by_microseconds_a_second() {
        let clock = ClockError { offset: Span::from_millis(-50), drift_ppm: 10.0 };
        assert_eq!(clock.at(Span::ZERO), Span::from_millis(-50));
        assert_eq!(clock.at(Span::from_millis(100_000)), Span::from_millis(-49));
        assert_eq!(ClockError::default().at(Span::from_millis(i64::MAX)), Span::ZERO);
    }
}
