//! How an agent's headings err: they may be turned round, or off by a constant.

use super::Measurement;
use super::position_errors::LEAST_INTERVAL_S;
use serde::{Deserialize, Serialize};
use v2x_common::geometry::wrap_angle;

/// ln of 49 to 1.
const LN_49: f64 = 3.891_820_298_110_627;

/// How long errors of headings last, s (.35 to .79 are left after a second on recorded data).
const LASTS_S: f64 = 2.0;
/// After so long, positions tell that an object turns, s.
const TOLD_BY_POSITIONS_S: f64 = 1.0;
/// A heading that is off by more standard deviations tells rather of a turn.
const OFF_SIGMAS: f64 = 1.5;

/// How an object turns when its heading is reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Its turn rate, rad/s.
    pub rate: f64,
    /// By how much the reported heading is off, rad.
    pub off: f64,
}

/// An agent's headings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum HeadingLaw {
    /// They err by a normal distribution, as declared.
    #[default]
    AsReported,
    /// They may also be turned by half a turn, or by a quarter where width and depth are exchanged.
    Mixture {
        /// ln of the odds that a reported front is the front.
        front_odds_ln: f64,
        /// Constant error, rad.
        offset: f64,
        /// Variance of the part of the errors that lasts for seconds, rad²: it does not average out over frames.
        lasting: f64,
        /// Share of the declared variance that is presumed to last besides, in [0, 1].
        lasting_share: f64,
        /// Of what stands: how many times the declared variance that of the headings is; at least 1.
        standing: f64,
    },
}

impl HeadingLaw {
    /// Of an agent that nothing is known of: one heading in fifty is turned round.
    pub const UNKNOWN: Self =
        Self::Mixture { front_odds_ln: LN_49, offset: 0.0, lasting: 0.0, lasting_share: 0.0, standing: 1.0 };

    /// Share of the variance that is presumed to last where an agent does not describe its errors: boxes are fitted to the side
    /// that is seen (.35 to .79 on recorded data).
    pub const PRESUMED_SHARE: f64 = 0.5;

    /// Of an agent that nothing is known of, and that does not describe its errors.
    pub const UNDESCRIBED: Self = Self::Mixture {
        front_odds_ln: LN_49,
        offset: 0.0,
        lasting: 0.0,
        lasting_share: Self::PRESUMED_SHARE,
        standing: 1.0,
    };

    /// A heading (rad) as it was reported, before it was corrected.
    pub fn reported(&self, yaw: f64) -> f64 {
        match *self {
            Self::Mixture { offset, .. } => yaw + offset,
            Self::AsReported => yaw,
        }
    }

    /// ln of the odds that a reported front is the front.
    #[inline]
    pub const fn front_odds_ln(&self) -> f64 {
        match *self {
            Self::Mixture { front_odds_ln, .. } => front_odds_ln,
            Self::AsReported => 0.0,
        }
    }

    /// How many times the declared variance that of the headings of what stands is.
    #[inline]
    pub const fn standing(&self) -> f64 {
        match *self {
            Self::Mixture { standing, .. } => standing,
            Self::AsReported => 1.0,
        }
    }

    /// Whether some of the errors last.
    #[inline]
    pub const fn lasts(&self) -> bool {
        matches!(*self, Self::Mixture { lasting, lasting_share, .. } if lasting + lasting_share > 0.0)
    }

    /// Variance (rad²) by which a heading of this declared one counts for less, with this time between frames, s: of errors that
    /// last for a time τ a mean over much more than τ is as uncertain as that of white ones of 2τ/Δt times their variance (power
    /// spectral density at 0 of a first-order Gauss-Markov process: Gelb 1974, section 2.4).
    ///
    /// So much only where an object goes straight on: in a bend, and where the heading is off by more than such errors explain,
    /// it tells of a turn before positions do.
    #[inline]
    pub fn by_lasting(&self, declared: f64, interval_s: f64, turn: &Turn) -> f64 {
        let Self::Mixture { lasting, lasting_share, .. } = *self else { return 0.0 };
        let variance = lasting + lasting_share * declared;
        if variance <= 0.0 {
            return 0.0;
        }
        let turned = turn.rate * TOLD_BY_POSITIONS_S;
        let off2 = turn.off * turn.off / (OFF_SIGMAS * OFF_SIGMAS * (declared + lasting));
        let goes_straight = 1.0 / (1.0 + turned * turned / variance + off2 * off2);
        // Frames of one instant have no time between them.
        let reports = 2.0 * LASTS_S / interval_s.max(LEAST_INTERVAL_S) - 1.0;
        variance * reports.max(0.0) * goes_straight
    }

    /// Takes the constant error from a measurement.
    pub fn correct(&self, z: &mut Measurement) {
        if let Self::Mixture { offset, .. } = *self
            && offset != 0.0
        {
            z.yaw = wrap_angle(z.yaw - offset);
        }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> (&'static str, String) {
    let share = HeadingLaw::PRESUMED_SHARE;
    (
        "headings.last",
        format!(
            "{LASTS_S} s, share {share}, within {OFF_SIGMAS} sigma and a turn in {TOLD_BY_POSITIONS_S} s"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_whose_errors_last_count_for_less_where_an_object_goes_straight_on_and_in_a_bend_as_declared()
    {
        let law = HeadingLaw::UNDESCRIBED;
        let (declared, interval_s) = (0.01, 0.1);
        let more = |rate: f64, off: f64| law.by_lasting(declared, interval_s, &Turn { rate, off });
        assert!((more(0.0, 0.0) - 0.195).abs() < 1e-12, "half of it, 39 times: {}", more(0.0, 0.0));
        assert!(more(0.0, 0.1) > 0.15, "as far off as such errors go");
        assert!(more(0.0, 0.5) < 0.005, "rather a turn");
        assert!(more(0.6, 0.0) < 0.005, "a bend");
        assert_eq!(law.by_lasting(declared, 10.0, &Turn { rate: 0.0, off: 0.0 }), 0.0, "seldom frames");
        let of_one_instant = law.by_lasting(declared, 0.0, &Turn { rate: 0.0, off: 0.0 });
        assert!(of_one_instant.is_finite() && of_one_instant > 0.0, "{of_one_instant}");
        assert!(law.lasts() && !HeadingLaw::UNKNOWN.lasts() && !HeadingLaw::AsReported.lasts());
    }
}
