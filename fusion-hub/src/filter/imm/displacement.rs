//! The displacement of a body with Gaussian heading, speed and turn rate.
//!
//! In the complex plane a step is (v·t + i·u·t)·exp(i h), with speed v, sideways speed u of the centre and
//! heading h half-way: polynomials in Gaussians times exp(i h), whose means and covariances are known in
//! closed form (Stein's lemma, and E[f(X) exp(i h)] = exp(i h̄ − σ²/2)·E[f(X + i·cov(X, h))]). They are the
//! integrals that a cubature filter (Arasaratnam & Haykin 2009) approximates by ten points, without the
//! points.

use super::gaussian::{Full, SPEED, TURN, YAW, at};
use crate::values::share_lost;
use v2x_common::covariance::Covariance2;

/// A complex number: east and north.
#[derive(Clone, Copy, Debug)]
pub(super) struct Complex {
    pub(super) re: f64,
    pub(super) im: f64,
}

impl Complex {
    const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    fn plus(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }

    fn times(self, other: Self) -> Self {
        Self::new(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)
    }

    fn scaled(self, factor: f64) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }

    fn norm2(self) -> f64 {
        self.re * self.re + self.im * self.im
    }

    fn times_i(self) -> Self {
        Self::new(-self.im, self.re)
    }
}

/// Moments of D = (along·v + i·aside·ω)·exp(i h), h = θ + ahead·ω.
pub(super) struct Displacement {
    pub(super) mean: Complex,
    pub(super) covariance: Covariance2,
    /// Cov(s, D) for every component s of the state.
    pub(super) cross: [Complex; 5],
    /// E[exp(i h)].
    pub(super) direction: Complex,
    /// E[exp(2 i h)].
    pub(super) axis: Complex,
}

impl Displacement {
    pub(super) fn of(state: &Full, along: f64, aside: f64, ahead: f64) -> Self {
        let entry = |row, column| state.covariance[at(row, column)];
        let with_h: [f64; 5] = std::array::from_fn(|s| entry(s, YAW) + ahead * entry(s, TURN));
        let variance_h = with_h[YAW] + ahead * with_h[TURN];
        let (sin, cos) = libm::sincos(state.mean[YAW] + ahead * state.mean[TURN]);
        // exp(−σ²) − 1: what follows is arranged so that nothing cancels at any speed.
        let lost = -share_lost(variance_h);
        let squared = 1.0 + lost;
        let shrunk = libm::sqrt(squared);
        let direction = Complex::new(cos * shrunk, sin * shrunk);
        let axis = direction.times(direction).scaled(squared);
        let tilt = Complex::new(along * with_h[SPEED], aside * with_h[TURN]).times_i();
        let amplitude = Complex::new(along * state.mean[SPEED], aside * state.mean[TURN]).plus(tilt);
        let mean = direction.times(amplitude);
        let (vv, uu) = (along * along * entry(SPEED, SPEED), aside * aside * entry(TURN, TURN));
        let vu = along * aside * entry(SPEED, TURN);
        // E[D²] − E[D]² and E|D|² − |E[D]|².
        let tilted = amplitude.scaled(2.0).plus(tilt).times(tilt).plus(Complex::new(vv - uu, 2.0 * vu));
        let pseudo = direction
            .times(direction)
            .times(amplitude.times(amplitude).scaled(lost).plus(tilted.scaled(squared)));
        let power = tilt.norm2() - 2.0 * (amplitude.re * tilt.re + amplitude.im * tilt.im) + vv + uu
            - amplitude.norm2() * lost;
        let covariance =
            Covariance2 { xx: (power + pseudo.re) / 2.0, xy: pseudo.im / 2.0, yy: (power - pseudo.re) / 2.0 };
        let cross = std::array::from_fn(|s| {
            let linear = Complex::new(along * entry(s, SPEED), aside * entry(s, TURN));
            direction.times(linear).plus(mean.times_i().scaled(with_h[s]))
        });
        Self { mean, covariance, cross, direction, axis }
    }
}
