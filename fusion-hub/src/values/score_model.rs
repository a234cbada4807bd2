//! What a detector's confidence score says of an object.

use libm::{exp, log};

/// Evidence is held in steps of this, in units of the natural logarithm of odds.
const STEP: f64 = 0.125;
/// Scores are limited to this and to one less this: no score is proof.
const LEAST_SCORE: f64 = 0.01;

/// How an agent's scores are read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ScoreModel {
    /// They are no evidence: all of them are the same, or nothing is known of them yet.
    #[default]
    Ignored,
    /// Logarithmic odds of a real object: a slope times the score's own, from a neutral score on.
    Logistic {
        /// ln of the odds of the neutral score.
        neutral: f64,
        /// Slope.
        slope: f64,
    },
}

/// ln of the odds of a score.
pub fn logit(score: f64) -> f64 {
    let limited = score.clamp(LEAST_SCORE, 1.0 - LEAST_SCORE);
    log(limited / (1.0 - limited))
}

/// The evidence of a score: the natural logarithm of a factor on the odds of existence, in one byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScoreEvidence(i8);

impl ScoreModel {
    /// What a score is worth.
    #[expect(clippy::cast_possible_truncation, reason = "clamped to a byte")]
    pub fn evidence(&self, score: f64) -> ScoreEvidence {
        match self {
            Self::Ignored => ScoreEvidence(0),
            Self::Logistic { neutral, slope } => {
                let steps = slope * (logit(score) - neutral) / STEP;
                ScoreEvidence(libm::round(steps.clamp(-127.0, 127.0)) as i8)
            }
        }
    }
}

impl ScoreEvidence {
    /// No evidence.
    pub const NONE: Self = Self(0);

    /// The natural logarithm of the factor.
    #[inline]
    pub fn ln(self) -> f64 {
        f64::from(self.0) * STEP
    }

    /// The factor; exactly 1 without evidence.
    #[inline]
    pub fn factor(self) -> f64 {
        if self.0 == 0 { 1.0 } else { exp(self.ln()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_neutral_score_is_no_evidence_and_higher_ones_are_for_an_object() {
        let model = ScoreModel::Logistic { neutral: logit(0.3), slope: 2.0 };
        assert_eq!(model.evidence(0.3).factor(), 1.0);
        assert!((model.evidence(0.5).ln() - 1.69).abs() < STEP);
        assert!(model.evidence(0.1).ln() < -2.5);
        assert!(model.evidence(0.0).ln().is_finite() && model.evidence(1.0).ln().is_finite());
        assert_eq!(ScoreModel::Ignored.evidence(0.9).factor(), 1.0);
    }
}
