//! When an agent captures: rate and phase.

use rand::Rng;
use v2x_common::time::Span;

use crate::random::uniform;

/// A time within a period, since the start of the scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// This time.
    Fixed(Span),
    /// Drawn once for each run and agent, evenly over the period.
    Random,
}

impl Phase {
    /// The phase within `period`; draws from `rng` only where the phase is random.
    pub fn within<R: Rng + ?Sized>(self, period: Span, rng: &mut R) -> Span {
        match self {
            Self::Fixed(phase) => phase,
            Self::Random => Span::from_secs_f64(uniform(rng, 0.0, period.as_secs_f64())),
        }
    }
}

/// Frames per second, as a whole number of millihertz, so that capture times do not drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    millihertz: u32,
}

impl Rate {
    const NANOS_PER_KILOSECOND: i128 = 1_000_000_000_000;

    /// Rounded to the nearest millihertz; `None` outside of 0.1 to 1000 Hz.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked")]
    pub fn from_hz(rate_hz: f64) -> Option<Self> {
        (0.1..=1000.0).contains(&rate_hz).then(|| Self { millihertz: libm::round(rate_hz * 1e3) as u32 })
    }

    /// In Hz.
    pub fn hz(self) -> f64 {
        f64::from(self.millihertz) / 1e3
    }

    /// Frames in a second, rounded up.
    pub const fn frames_in_a_second(self) -> u32 {
        self.millihertz.div_ceil(1000)
    }

    /// From frame 0 to frame `sequence`, rounded down to the nanosecond; saturates after 292 years.
    pub fn elapsed(self, sequence: u64) -> Span {
        let nanos = i128::from(sequence) * Self::NANOS_PER_KILOSECOND / i128::from(self.millihertz);
        Span::from_nanos(i64::try_from(nanos).unwrap_or(i64::MAX))
    }

    /// The first frame whose [`Self::elapsed`] is at least `span`.
    pub fn sequence_at_or_after(self, span: Span) -> u64 {
        let product = i128::from(span.as_nanos().max(0)) * i128::from(self.millihertz);
        let sequence = (product + Self::NANOS_PER_KILOSECOND - 1) / Self::NANOS_PER_KILOSECOND;
        u64::try_from(sequence).expect("2^63 ns at 1000 Hz are below 2^64 frames")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn capture_times_of_any_rate_do_not_drift() {
        let rate = Rate::from_hz(3.0).unwrap();
        assert_eq!(rate.elapsed(1).as_nanos(), 333_333_333);
        assert_eq!(rate.elapsed(3 * 3600 * 24), Span::from_millis(24 * 3_600_000));
        assert_eq!(Rate::from_hz(0.0), None);
        assert_eq!(Rate::from_hz(f64::NAN), None);
    }

    proptest! {
        #[test]
        fn the_next_frame_is_the_first_at_or_after_the_time(rate_hz in 0.1..1000.0f64, nanos in 0..i64::MAX / 2) {
            let rate = Rate::from_hz(rate_hz).unwrap();
            let sequence = rate.sequence_at_or_after(Span::from_nanos(nanos));
            prop_assert!(rate.elapsed(sequence).as_nanos() >= nanos);
            prop_assert!(sequence == 0 || rate.elapsed(sequence - 1).as_nanos() < nanos);
        }
    }
}
