//! The joint estimate of two agents' errors.

use super::model::dot;
use serde::{Deserialize, Serialize};

/// The joint estimate of two agents' errors, in units of the declared accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Pair {
    pub(super) mean: [f64; 8],
    pub(super) covariance: [[f64; 8]; 8],
}

impl Pair {
    /// aᵀ (P + W) b.
    pub(super) fn spread(&self, a: &[f64; 8], b: &[f64; 8], white: &[f64; 8]) -> f64 {
        dot(a, &self.through(b, white))
    }

    /// (P + W) b.
    pub(super) fn through(&self, b: &[f64; 8], white: &[f64; 8]) -> [f64; 8] {
        let mut through = [0.0; 8];
        // P is symmetric: its rows are its columns.
        for (column, b) in self.covariance.iter().zip(b) {
            through.iter_mut().zip(column).for_each(|(through, p)| *through += p * b);
        }
        through.iter_mut().zip(white.iter().zip(b)).for_each(|(through, (w, b))| *through += w * b);
        through
    }
}
