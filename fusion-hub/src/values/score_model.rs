//! What a detector's confidence score says of an object.

use libm::{exp, log};
use serde::{Deserialize, Serialize};

/// Evidence is held in steps of this, in units of the natural logarithm of odds.
const STEP: f64 = 0.125;
/// Scores are limited to this and to one less this: no score is proof.
const LEAST_SCORE: f64 = 0.01;

/// Bands of scores, of equal width in the logarithm of their odds: their number, the centre of the first, and the width.
pub const SCORE_BANDS: usize = 10;
const FIRST_BAND: f64 = -3.375;
const BAND_WIDTH: f64 = 0.75;

/// The scores between two bands: halfway between their centres, in the logarithm of odds.
const EDGES: [f64; SCORE_BANDS - 1] = [
    0.047_425_873_177_566_78,
    0.095_349_464_899_109_49,
    0.182_425_523_806_356_35,
    0.320_821_300_824_607,
    0.5,
    0.679_178_699_175_393,
    0.817_574_476_193_643_7,
    0.904_650_535_100_890_6,
    0.952_574_126_822_433_4,
];

/// How an agent's scores are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum ScoreModel {
    /// They are no evidence: all of them are the same, or nothing is known of them yet.
    #[default]
    Ignored,
    /// Logarithmic odds of a real object at the centre of each band; linear between two, and constant beyond the last.
    Calibrated {
        /// By band.
        ln_odds: [f32; SCORE_BANDS],
    },
}

/// ln of the odds of a score.
pub fn logit(score: f64) -> f64 {
    let limited = score.clamp(LEAST_SCORE, 1.0 - LEAST_SCORE);
    log(limited / (1.0 - limited))
}

/// A band of scores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScoreBand(u8);

impl ScoreBand {
    /// The band of the least scores.
    pub const LEAST: Self = Self(0);

    /// The band of a score.
    #[inline]
    pub fn of(score: f64) -> Self {
        Self(EDGES.iter().map(|edge| u8::from(score >= *edge)).sum())
    }

    /// As an index.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// ln of the odds that the scores at the centres of the bands state.
    pub fn centres() -> [f64; SCORE_BANDS] {
        #[expect(clippy::cast_precision_loss, reason = "a few")]
        std::array::from_fn(|band| FIRST_BAND + BAND_WIDTH * band as f64)
    }
}

/// The evidence of a score: the natural logarithm of a factor on the odds of existence, in one byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScoreEvidence(i8);

impl ScoreModel {
    /// With logarithmic odds that are a slope times those which the score states, from a neutral score on.
    #[expect(clippy::cast_possible_truncation, reason = "single precision is intended")]
    pub fn logistic(neutral_ln: f64, slope: f64) -> Self {
        Self::Calibrated {
            ln_odds: ScoreBand::centres().map(|centre| (slope * (centre - neutral_ln)) as f32),
        }
    }

    /// ln of the odds that something with this score is real; 0 where scores are no evidence.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the bands")]
    pub fn ln_odds(&self, score: f64) -> f64 {
        let Self::Calibrated { ln_odds } = self else { return 0.0 };
        let place = ((logit(score) - FIRST_BAND) / BAND_WIDTH).clamp(0.0, (SCORE_BANDS - 1) as f64);
        let below = (place as usize).min(SCORE_BANDS - 2);
        let [from, to] = [below, below + 1].map(|band| f64::from(ln_odds[band]));
        #[expect(clippy::cast_precision_loss, reason = "a few")]
        let share = place - below as f64;
        from + share * (to - from)
    }

    /// What a score is worth.
    #[expect(clippy::cast_possible_truncation, reason = "clamped to a byte")]
    pub fn evidence(&self, score: f64) -> ScoreEvidence {
        if *self == Self::Ignored {
            return ScoreEvidence::NONE;
        }
        ScoreEvidence(libm::round((self.ln_odds(score) / STEP).clamp(-127.0, 127.0)) as i8)
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
        let model = ScoreModel::logistic(logit(0.3), 2.0);
        assert_eq!(model.evidence(0.3).factor(), 1.0);
        assert!((model.evidence(0.5).ln() - 1.69).abs() < STEP);
        assert!(model.evidence(0.1).ln() < -2.5);
        assert!(model.evidence(0.0).ln().is_finite() && model.evidence(1.0).ln().is_finite());
        assert_eq!(ScoreModel::Ignored.evidence(0.9).factor(), 1.0);
    }

    #[test]
    fn odds_are_linear_between_the_bands_and_constant_beyond_them() {
        let mut ln_odds = [0.0; SCORE_BANDS];
        ln_odds[SCORE_BANDS - 1] = 4.0;
        let model = ScoreModel::Calibrated { ln_odds };
        let centres = ScoreBand::centres();
        let score_at = |ln: f64| 1.0 / (1.0 + exp(-ln));
        let last = centres[SCORE_BANDS - 1];
        assert!((model.ln_odds(score_at(last - BAND_WIDTH / 4.0)) - 3.0).abs() < 1e-9);
        assert_eq!((model.ln_odds(0.99), model.ln_odds(0.0)), (4.0, 0.0));
        for (band, centre) in centres.into_iter().enumerate() {
            assert_eq!(ScoreBand::of(score_at(centre)).index(), band);
        }
        for (edge, centre) in EDGES.into_iter().zip(centres) {
            assert!((edge - score_at(centre + BAND_WIDTH / 2.0)).abs() < 1e-15);
        }
    }
}
