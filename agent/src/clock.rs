//! The error of an agent's clock.

use v2x_common::time::Span;

/// Error of a clock. Its time is true time + offset + drift · (time since the scenario's start).
///
/// It affects only time stamps. Agents capture and send at true times, so that a run with a clock error has the same
/// detections and differs in the stamps alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockError {
    /// Its lead at the scenario's start.
    pub offset: Span,
    /// Its excess rate, parts per million.
    pub drift_ppm: f64,
}

impl ClockError {
    /// Its lead at this true time since the scenario's start.
    pub fn at(&self, since_start: Span) -> Span {
        self.offset + Span::from_secs_f64(1e-6 * self.drift_ppm * since_start.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_offset_grows_with_the_drift() {
        let clock = ClockError { offset: Span::from_millis(-50), drift_ppm: 10.0 };
        assert_eq!(clock.at(Span::ZERO), Span::from_millis(-50));
        assert_eq!(clock.at(Span::from_millis(100_000)), Span::from_millis(-49));
        assert_eq!(ClockError::default().at(Span::from_millis(i64::MAX)), Span::ZERO);
    }
}
