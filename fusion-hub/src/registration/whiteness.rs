//! How much of an agent's error is drawn anew for each frame.
//!
//! Such an error is common to all that one frame reports: many objects say of it what one says, and a hundred frames are
//! no more than a hundred draws. With a frame's information Λ in units of σ, r = η − Λ m has covariance
//! Λ + Λ P Λ + κ Λ², where κσ² is the variance of that error; so the mean of rᵀr gives κ (method of moments).

use super::group::Group;
use super::model::dot;
use super::pair::Pair;

/// Taken beforehand, as if this many frames had shown it: a tenth of what is declared.
const AT_FIRST: f64 = 0.1;
const FRAMES_AT_FIRST: f64 = 3.0;
/// An agent may declare half of what it errs by, not less.
const MOST: f64 = 4.0;
/// What frames showed so long ago hardly counts, s.
const MEMORY_S: f64 = 20.0;

/// One agent's κ, with how it was come by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Whiteness {
    sum: f64,
    weight: f64,
}

impl Whiteness {
    /// In units of the declared variance.
    pub(super) fn kappa(&self) -> f64 {
        let mean = (FRAMES_AT_FIRST * AT_FIRST + self.sum) / (FRAMES_AT_FIRST + self.weight);
        mean.clamp(0.0, MOST)
    }

    /// Notes what a frame shows.
    pub(super) fn note(&mut self, shown: Shown) {
        self.sum += shown.weight * shown.kappa;
        self.weight += shown.weight;
    }

    /// The declared standard deviation was multiplied by the inverse of this; `None` where one of both is zero.
    pub(super) fn rescale(&mut self, ratio: Option<f64>) {
        match ratio {
            Some(ratio) => self.sum *= ratio * ratio,
            None => *self = Self::default(),
        }
    }

    pub(super) fn fade(&mut self, dt_s: f64) {
        let kept = libm::exp(-dt_s / MEMORY_S);
        self.sum *= kept;
        self.weight *= kept;
    }
}

/// One frame's κ, and how much it says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shown {
    kappa: f64,
    weight: f64,
}

impl Shown {
    /// Of a frame and one partner; it is not told apart which of the two it was.
    pub(super) fn by(group: &Group, believed: &Pair) -> Self {
        let lambda = &group.lambda;
        let (mut shown, mut expected, mut squares) = (0.0, 0.0, 0.0);
        for (k, row) in lambda.iter().enumerate() {
            let rest = group.eta[k] - dot(row, &believed.mean);
            shown += rest * rest;
            expected += row[k] + believed.spread(row, row, &[0.0; 8]);
            squares += dot(row, row);
        }
        if squares <= 0.0 || !(shown - expected).is_finite() {
            return Self { kappa: 0.0, weight: 0.0 };
        }
        // A frame that says less of its agent than the reports' own noise allows shows little of κ.
        let trace: f64 = (0..8).map(|k| lambda[k][k]).sum();
        let told = AT_FIRST * squares / trace;
        let share = told / (1.0 + told);
        Self { kappa: ((shown - expected) / squares).min(MOST), weight: share * share }
    }
}

#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![(
        "registration.whiteness",
        format!("{AT_FIRST} of {FRAMES_AT_FIRST} frames, at most {MOST}, within {MEMORY_S} s"),
    )]
}
