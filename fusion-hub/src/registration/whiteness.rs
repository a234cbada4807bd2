//! The share of an agent's error that is independent in each frame.
//!
//! Such an error is common to all detections of a frame: many objects give the information of one, and a hundred frames
//! are a hundred draws. With a frame's information Λ in units of σ, r = η − Λ m has covariance Λ + Λ P Λ + κ Λ², where
//! κσ² is the variance of that error; so the mean of rᵀr gives κ (method of moments).

use super::group::Group;
use super::model::dot;
use super::pair::Pair;
use serde::{Deserialize, Serialize};

/// Prior, with the weight of this many frames: a tenth of the declared variance.
const AT_FIRST: f64 = 0.1;
const FRAMES_AT_FIRST: f64 = 3.0;
/// An agent's error may be up to twice what it declares.
const MOST: f64 = 4.0;
/// Time constant with which older frames lose weight, s.
const MEMORY_S: f64 = 20.0;

/// One agent's κ, with its sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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

    /// Adds a frame's estimate.
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

/// One frame's κ, with its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shown {
    kappa: f64,
    weight: f64,
}

impl Shown {
    /// Of a frame and one partner; the two are not distinguished.
    pub(super) fn by(group: &Group, estimate: &Pair) -> Self {
        let lambda = &group.lambda;
        let (mut shown, mut expected, mut squares) = (0.0, 0.0, 0.0);
        for (k, row) in lambda.iter().enumerate() {
            let rest = group.eta[k] - dot(row, &estimate.mean);
            shown += rest * rest;
            expected += row[k] + estimate.spread(row, row, &[0.0; 8]);
            squares += dot(row, row);
        }
        if squares <= 0.0 || !(shown - expected).is_finite() {
            return Self { kappa: 0.0, weight: 0.0 };
        }
        // A frame with less information than the reports' own noise gives κ little weight.
        let trace: f64 = (0..8).map(|k| lambda[k][k]).sum();
        let information = AT_FIRST * squares / trace;
        let share = information / (1.0 + information);
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
