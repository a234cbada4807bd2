//! Velocity in the map frame: what one model predicts, and the likelihood of a measured velocity under it.

use super::displacement::Displacement;
use super::gaussian::{Full, at};
use super::likelihood::{Factored, Likelihood, sum};
use v2x_common::covariance::Covariance2;

/// Velocity that annotators and detectors report of a standing body, and sideslip of a moving one:
/// standard deviation on each axis, m/s.
const SIGMA_SLIP: f64 = 0.1;

/// Velocity of a body's centre in the map frame, as moments.
pub(super) struct Velocity {
    /// m/s.
    pub(super) mean: [f64; 2],
    /// m²/s².
    pub(super) covariance: Covariance2,
    /// Covariance with every component of the state.
    pub(super) cross: [[f64; 2]; 5],
}

/// Of a body that moves.
pub(super) fn velocity(state: &Full, lever_m: f64) -> Velocity {
    let Displacement { mean, covariance, cross, .. } = Displacement::of(state, 1.0, lever_m, 0.0);
    Velocity {
        mean: [mean.re, mean.im],
        covariance: slipping(&covariance),
        cross: cross.map(|c| [c.re, c.im]),
    }
}

/// A velocity's covariance with sideslip.
pub(super) fn slipping(covariance: &Covariance2) -> Covariance2 {
    let slip = SIGMA_SLIP * SIGMA_SLIP;
    Covariance2 { xx: covariance.xx + slip, xy: covariance.xy, yy: covariance.yy + slip }
}

/// How likely a velocity report is of a body that stands.
pub(super) fn still_velocity(z: [f64; 2], r: &Covariance2) -> Likelihood {
    let s = Factored::of(&slipping(r));
    s.likelihood(s.split(z))
}

/// Updates by a measured velocity: the linear update with exact moments.
pub(super) fn update_velocity(state: &mut Full, lever_m: f64, z: [f64; 2], r: &Covariance2) -> Likelihood {
    let Velocity { mean, covariance, cross } = velocity(state, lever_m);
    let s = Factored::of(&sum(&covariance, r));
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
