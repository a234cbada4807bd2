//! Velocity in the map frame: what one model predicts, and the likelihood of a measured velocity under it.

use super::displacement::Displacement;
use super::gaussian::{Full, at};
use super::likelihood::{Factored, Likelihood, Symmetric};
use crate::values::Real;

/// Velocity that annotators and detectors report of a standing body, and sideslip of a moving one:
/// standard deviation on each axis, m/s.
const SIGMA_SLIP: f64 = 0.1;

/// Velocity of a body's centre in the map frame, as moments.
pub(super) struct Velocity<R = f64> {
    /// m/s.
    pub(super) mean: [R; 2],
    /// m²/s².
    pub(super) covariance: Symmetric<R>,
    /// Covariance with every component of the state.
    pub(super) cross: [[R; 2]; 5],
}

/// Of a body that moves.
#[inline(always)]
pub(super) fn velocity<R: Real>(state: &Full<R>, lever_m: R) -> Velocity<R> {
    let (zero, one) = (lever_m.same(0.0), lever_m.same(1.0));
    let Displacement { mean, covariance, cross, .. } = Displacement::of(state, one, lever_m, zero);
    let mut pairs = [[zero; 2]; 5];
    for (pair, cross) in pairs.iter_mut().zip(&cross) {
        *pair = [cross.re, cross.im];
    }
    Velocity { mean: [mean.re, mean.im], covariance: slipping(&covariance), cross: pairs }
}

/// A velocity's covariance with sideslip.
#[inline(always)]
pub(super) fn slipping<R: Real>(covariance: &Symmetric<R>) -> Symmetric<R> {
    let slip = SIGMA_SLIP * SIGMA_SLIP;
    Symmetric { xx: covariance.xx + slip, xy: covariance.xy, yy: covariance.yy + slip }
}

/// How likely a velocity report is of a body that stands.
pub(super) fn still_velocity(z: [f64; 2], r: &Symmetric) -> Likelihood {
    let s = Factored::of(&slipping(r));
    s.likelihood(s.split(z))
}

/// Updates by a measured velocity: the linear update with exact moments.
pub(super) fn update_velocity(state: &mut Full, lever_m: f64, z: [f64; 2], r: &Symmetric) -> Likelihood {
    let Velocity { mean, covariance, cross } = velocity(state, lever_m);
    let s = Factored::of(&covariance.plus(r));
    let innovation = s.split([z[0] - mean[0], z[1] - mean[1]]);
    let cross = cross.map(|cross| s.split(cross));
    for (mean, cross) in state.mean.iter_mut().zip(cross) {
        *mean += s.product(cross, innovation);
    }
    for row in 0..5 {
        for column in 0..=row {
            state.covariance[at(row, column)] -= s.product(cross[row], cross[column]);
        }
    }
    state.wrap();
    s.likelihood(innovation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, SMatrix, SVector};

    fn state() -> Full {
        let mut covariance = [0.0; 15];
        for (i, variance) in [0.3, 0.4, 0.02, 1.5, 0.04].into_iter().enumerate() {
            covariance[at(i, i)] = variance;
        }
        covariance[at(3, 0)] = 0.2;
        covariance[at(3, 2)] = 0.05;
        covariance[at(4, 2)] = 0.01;
        Full { mean: [5.0, -2.0, 0.6, 7.0, 0.1], covariance }
    }

    #[test]
    fn a_standing_body_has_the_velocity_that_detectors_report_of_it() {
        let r = Symmetric { xx: 0.04, xy: 0.01, yy: 0.09 };
        let found = still_velocity([0.3, -0.2], &r);
        let s = Matrix2::new(0.04 + 0.01, 0.01, 0.01, 0.09 + 0.01);
        let z = nalgebra::Vector2::new(0.3, -0.2);
        let distance2 = (z.transpose() * s.try_inverse().unwrap() * z)[0];
        assert!((found.mahalanobis2 - distance2).abs() < 1e-12);
        assert!((found.determinant - s.determinant()).abs() < 1e-12);
    }

    #[test]
    fn a_measured_velocity_updates_as_the_dense_linear_update() {
        let lever_m = 1.2;
        let (z, r) = ([6.5, 3.0], Symmetric { xx: 0.2, xy: 0.05, yy: 0.3 });
        let before = state();
        let predicted = velocity(&before, lever_m);
        let mut found = before;
        let likelihood = update_velocity(&mut found, lever_m, z, &r);
        let of = |c: &Symmetric| Matrix2::new(c.xx, c.xy, c.xy, c.yy);
        let s = of(&predicted.covariance) + of(&r);
        let cross = SMatrix::<f64, 5, 2>::from_fn(|row, column| predicted.cross[row][column]);
        let gain = cross * s.try_inverse().unwrap();
        let innovation = nalgebra::Vector2::new(z[0] - predicted.mean[0], z[1] - predicted.mean[1]);
        let mean = SVector::<f64, 5>::from(before.mean) + gain * innovation;
        let taken = gain * cross.transpose();
        for row in 0..5 {
            assert!((found.mean[row] - mean[row]).abs() < 1e-12, "{row}");
            for column in 0..=row {
                let expected = before.covariance[at(row, column)] - taken[(row, column)];
                assert!((found.covariance[at(row, column)] - expected).abs() < 1e-12, "{row} {column}");
            }
        }
        assert!((likelihood.determinant - s.determinant()).abs() < 1e-12);
    }
}
