//! The information of one frame and one partner about their errors, from all shared objects.

use super::cholesky;
use super::model::{Difference, dot};
use super::pair::Pair;
use serde::{Deserialize, Serialize};
use v2x_common::covariance::Covariance2;

/// Differences further from what is expected than this, squared and normalised, weigh the less the further they are
/// (Huber 1964; the weight is squared, so that a wrong association has no effect in the limit).
const TRUSTED: f64 = 9.0;

/// Places of the clocks.
const CLOCKS: [usize; 2] = [3, 7];

/// Information of both agents' errors, in units of what they declare: Λ and η, with Λ b = η.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Group {
    pub(super) lambda: [[f64; 8]; 8],
    pub(super) eta: [f64; 8],
    pub(super) count: u32,
}

impl Group {
    pub(super) const EMPTY: Self = Self { lambda: [[0.0; 8]; 8], eta: [0.0; 8], count: 0 };

    /// Adds a difference, weighted by its distance from the estimate of the two; `white` are the variances of errors
    /// that are drawn independently for each frame.
    pub(super) fn add(&mut self, one: &Difference, estimate: &Pair, white: &[f64; 8]) {
        let [hx, hy] = &one.h;
        let off = [one.position[0] - dot(hx, &estimate.mean), one.position[1] - dot(hy, &estimate.mean)];
        let through_x = estimate.through(hx, white);
        let s = Covariance2 {
            xx: one.r.xx + dot(hx, &through_x),
            xy: one.r.xy + dot(hy, &through_x),
            yy: one.r.yy + dot(hy, &estimate.through(hy, white)),
        };
        let weight = trust(quadratic(&s, off));
        let det = one.r.determinant();
        let [xx, xy, yy] = [one.r.yy, -one.r.xy, one.r.xx].map(|entry| weight * entry / det);
        let [x, y] = one.position;
        for row in 0..8 {
            let (a, b) = (hx[row] * xx + hy[row] * xy, hx[row] * xy + hy[row] * yy);
            self.eta[row] += a * x + b * y;
            for column in 0..8 {
                self.lambda[row][column] += a * hx[column] + b * hy[column];
            }
        }
        // The noise's correlation with the velocity's error is no information about the clocks.
        let c = &one.with_velocity;
        let spurious = xx * c.xx + 2.0 * xy * c.xy + yy * c.yy;
        self.eta[CLOCKS[0]] += one.clocks[0] * spurious;
        self.eta[CLOCKS[1]] -= one.clocks[1] * spurious;
        if let Some(heading) = &one.heading {
            let off = heading.difference - dot(&heading.h, &estimate.mean);
            let s = heading.variance + estimate.spread(&heading.h, &heading.h, white);
            let information = trust(off * off / s) / heading.variance;
            for row in 0..8 {
                let a = heading.h[row] * information;
                self.eta[row] += a * heading.difference;
                for column in 0..8 {
                    self.lambda[row][column] += a * heading.h[column];
                }
            }
        }
        self.count += 1;
    }

    /// With the per-frame errors integrated out: Λ ← (Λ⁻¹ + W)⁻¹ = Λ − Λ S (1 + S Λ S)⁻¹ S Λ, where W = S² is
    /// diagonal, and η likewise.
    pub(super) fn without_white(&self, white: &[f64; 8]) -> Self {
        if *white == [0.0; 8] {
            return *self;
        }
        let s = white.map(libm::sqrt);
        let mut inner = [0.0; 64];
        for row in 0..8 {
            for column in 0..8 {
                let unit = if row == column { 1.0 } else { 0.0 };
                inner[8 * row + column] = unit + s[row] * self.lambda[row][column] * s[column];
            }
        }
        // One plus a positive semidefinite matrix: only overflow makes it singular.
        if cholesky::invert(&mut inner, &mut [0.0; 64], 8).is_err() {
            return Self::EMPTY;
        }
        // K = Λ S (1 + S Λ S)⁻¹ S
        let mut gain = [[0.0; 8]; 8];
        for (row, gain) in gain.iter_mut().enumerate() {
            for (column, gain) in gain.iter_mut().enumerate() {
                let through: f64 = (0..8).map(|k| self.lambda[row][k] * s[k] * inner[8 * k + column]).sum();
                *gain = through * s[column];
            }
        }
        let mut left = *self;
        for (row, gain) in gain.iter().enumerate() {
            left.eta[row] -= dot(gain, &self.eta);
            for column in 0..8 {
                // Λ is symmetric: its column is its row.
                left.lambda[row][column] -= dot(gain, &self.lambda[column]);
            }
        }
        left
    }
}

fn trust(squared: f64) -> f64 {
    if squared <= TRUSTED { 1.0 } else { TRUSTED * TRUSTED / (squared * squared) }
}

fn quadratic(s: &Covariance2, [x, y]: [f64; 2]) -> f64 {
    (s.yy * x * x - 2.0 * s.xy * x * y + s.xx * y * y) / s.determinant()
}

#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![("registration.trusted", TRUSTED.to_string())]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SMatrix;

    #[test]
    fn per_frame_errors_are_integrated_out_exactly() {
        let root = SMatrix::<f64, 8, 8>::from_fn(|i, j| libm::cos((1 + 2 * i + 5 * j) as f64));
        let lambda = root * root.transpose() + SMatrix::identity() * 0.3;
        let eta = SMatrix::<f64, 8, 1>::from_fn(|i, _| i as f64 - 2.0);
        let white = [0.4, 0.1, 0.0, 0.2, 0.0, 0.0, 0.3, 0.7];
        let group = Group { lambda: lambda.transpose().into(), eta: eta.into(), count: 3 };
        let left = group.without_white(&white);
        let w = SMatrix::<f64, 8, 8>::from_diagonal(&white.into());
        let covariance = lambda.try_inverse().unwrap() + w;
        let expected = covariance.try_inverse().unwrap();
        let expected_eta = expected * lambda.try_inverse().unwrap() * eta;
        for row in 0..8 {
            assert!((left.eta[row] - expected_eta[row]).abs() < 1e-9);
            for column in 0..8 {
                assert!((left.lambda[row][column] - expected[(row, column)]).abs() < 1e-9);
            }
        }
    }
}
