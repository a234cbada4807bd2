//! How far the headings that are reported of an object which stands contradict each other: a body does not turn where it stands.
//!
//! Where they do, by much more than is declared, one that is far from the object's heading is no news of it. The heading is the
//! one that most reports agree about, by their mean axis: what is at random cancels there.

use serde::{Deserialize, Serialize};

/// Weight of the newest report.
const NEWEST: f32 = 0.1;
/// Variances found beyond so many times the declared ones are contradictions.
const BEYOND: f32 = 4.0;
/// Further from the object's heading than this (χ²) a report is no news of it.
const FAR: f64 = 9.0;
/// The heading is set to the mean axis from this length of the mean vector and this angle, rad, on.
const LEAST_AGREEMENT: f32 = 0.3;
const LEAST_TURN: f64 = 0.3;
/// Standard deviation of that mean, rad.
const MEAN_SIGMA: f64 = 0.2;

/// Running means of the differences between reports and the heading of an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Contradiction {
    /// Squared difference, without what the object's own heading is uncertain by, rad².
    found: f32,
    /// What was declared, rad².
    declared: f32,
    /// Cosine and sine of twice the difference.
    axis: [f32; 2],
}

/// A report's heading, beside that of the object.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// The difference of the axes, rad.
    pub(super) off: f64,
    /// The report's declared variance, and that of the object's heading, rad².
    pub(super) declared: f64,
    pub(super) own: f64,
    /// How many times the declared variance the agent's headings are known to have.
    pub(super) times: f64,
}

impl Beside {
    /// Whether it is no news where reports contradict each other.
    fn is_far(&self) -> bool {
        self.off * self.off > FAR * (self.declared * self.times + self.own)
    }
}

/// What a report says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// It is of the heading.
    Counts,
    /// It says nothing of it.
    IsNoNews,
    /// Most reports agree about a heading that is off the object's by so much, rad, with this variance, rad².
    TurnsBy(f64, f64),
}

impl Contradiction {
    /// After a first report.
    pub(super) fn initial(declared: f64) -> Self {
        Self { found: 0.0, declared: single(declared), axis: [1.0, 0.0] }
    }

    /// What a report says that is of something of which nobody knows whether it stands.
    pub(super) fn judge(&self, report: &Beside) -> Verdict {
        if self.variance() > 0.0 && report.is_far() { Verdict::IsNoNews } else { Verdict::Counts }
    }

    /// Notes a report of what stands. Headings that are known to vary by so many times the declared variance say as much less.
    pub(super) fn note(&mut self, report: &Beside) -> Verdict {
        let Beside { off, declared, own, times } = *report;
        let weight = NEWEST / single(times);
        let is_far = report.is_far();
        // Of small angles.
        let axis = if is_far {
            [libm::cos(2.0 * off), libm::sin(2.0 * off)].map(single)
        } else {
            [1.0, single(2.0 * off)]
        };
        self.found += weight * (single((off * off - own).max(0.0)) - self.found);
        self.declared += weight * (single(declared) - self.declared);
        for (mean, newest) in self.axis.iter_mut().zip(axis) {
            *mean += weight * (newest - *mean);
        }
        if self.variance() == 0.0 {
            return Verdict::Counts;
        }
        let [cos, sin] = self.axis;
        let turn = f64::from(libm::atan2f(sin, cos) / 2.0);
        if turn.abs() > LEAST_TURN && libm::hypotf(cos, sin) > LEAST_AGREEMENT {
            self.axis = [libm::hypotf(cos, sin), 0.0];
            return Verdict::TurnsBy(turn, MEAN_SIGMA * MEAN_SIGMA);
        }
        if is_far { Verdict::IsNoNews } else { Verdict::Counts }
    }

    /// The variance that was found, where it is no chance, rad².
    pub(super) fn variance(&self) -> f64 {
        if self.found > BEYOND * self.declared { f64::from(self.found) } else { 0.0 }
    }
}

/// In single precision, which is enough for evidence.
#[expect(clippy::cast_possible_truncation, reason = "single precision is intended")]
pub(super) const fn single(evidence: f64) -> f32 {
    evidence as f32
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> (&'static str, String) {
    (
        "orientation.contradiction",
        format!(
            "{NEWEST} by one, beyond {BEYOND}, far from {FAR}; turned from {LEAST_TURN} rad and agreement {LEAST_AGREEMENT} on, sigma {MEAN_SIGMA}"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn report(off: f64, times: f64) -> Beside {
        Beside { off, declared: 0.0025, own: 0.0005, times }
    }

    #[test]
    fn reports_that_agree_within_what_is_declared_count_and_those_far_off_are_no_news() {
        let mut seen = Contradiction::initial(0.0025);
        for k in 0..100 {
            let off = if k % 2 == 0 { 0.06 } else { -0.06 };
            assert_eq!(seen.note(&report(off, 1.0)), Verdict::Counts);
        }
        assert_eq!((seen.variance(), seen.note(&report(1.0, 1.0))), (0.0, Verdict::IsNoNews));
        assert_eq!(seen.note(&report(0.02, 1.0)), Verdict::Counts, "what agrees goes on counting");
        assert!(seen.variance() > 0.0);
    }

    #[test]
    fn a_heading_that_most_reports_contradict_is_set_to_the_one_they_agree_about() {
        let mut seen = Contradiction::initial(0.0025);
        // Every other report is at random: each of these axes is as far from the others.
        let (mut off_by, mut turns) = (0.8, 0);
        for k in 0..200 {
            let off = if k % 2 == 0 { off_by } else { f64::from(k % 5) * FRAC_PI_2 * 2.0 / 5.0 - 1.2 };
            if let Verdict::TurnsBy(turn, _) = seen.note(&report(off, 1.0)) {
                off_by -= turn;
                turns += 1;
            }
        }
        assert!(turns > 0 && off_by.abs() < 0.3, "{turns} turns, {off_by} rad are left");
    }

    #[test]
    fn two_agents_a_quarter_apart_turn_nothing_and_one_that_is_known_to_vary_says_less() {
        let after = |times_of_the_other: f64| {
            let mut seen = Contradiction::initial(0.0025);
            for k in 0..100 {
                let is_other = k % 2 == 1;
                let (off, times) = if is_other { (FRAC_PI_2, times_of_the_other) } else { (0.0, 1.0) };
                let verdict = seen.note(&report(off, times));
                assert!(!matches!(verdict, Verdict::TurnsBy(..)), "{k}");
            }
            seen.variance()
        };
        assert!(after(1.0) > 0.5 && after(300.0) < 0.02, "{} {}", after(1.0), after(300.0));
    }
}
