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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    /// The trapezoidal rule over 7 standard deviations on either side: exact to rounding for such functions.
    const STEPS: i32 = 20;

    #[test]
    fn moments_are_those_of_the_integral_over_heading_speed_and_turn_rate() {
        // Strongly correlated, so that every term of second order counts.
        let factor = Matrix3::new(0.5, 0.0, 0.0, 0.9, 0.8, 0.0, 0.3, -0.2, 0.25);
        let p = factor * factor.transpose();
        let parts = [YAW, SPEED, TURN];
        let mut covariance = [0.0; 15];
        for (i, row) in parts.into_iter().enumerate() {
            for (j, column) in parts.into_iter().enumerate() {
                covariance[at(row, column)] = p[(i, j)];
            }
        }
        covariance[at(0, 0)] = 1.0;
        covariance[at(1, 1)] = 1.0;
        let state = Full { mean: [0.0, 0.0, 0.7, 1.5, 0.4], covariance };
        let (along, aside, ahead) = (0.8, 0.9, 0.35);
        let found = Displacement::of(&state, along, aside, ahead);
        let units = || (-STEPS..=STEPS).map(|k| 7.0 * f64::from(k) / f64::from(STEPS));
        let (mut weights, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        for (a, b, c) in units().flat_map(|a| units().flat_map(move |b| units().map(move |c| (a, b, c)))) {
            let weight = libm::exp(-(a * a + b * b + c * c) / 2.0);
            let off = factor * Vector3::new(a, b, c);
            let (yaw, v, turn) = (0.7 + off[0], 1.5 + off[1], 0.4 + off[2]);
            let (sin, cos) = libm::sincos(yaw + ahead * turn);
            let (forward, left) = (along * v, aside * turn);
            let [x, y] = [forward * cos - left * sin, forward * sin + left * cos];
            weights += weight;
            first = [first[0] + weight * x, first[1] + weight * y];
            second = [second[0] + weight * x * x, second[1] + weight * x * y, second[2] + weight * y * y];
        }
        let [x, y] = first.map(|sum| sum / weights);
        let [xx, xy, yy] = second.map(|sum| sum / weights);
        let Displacement { mean, covariance, .. } = found;
        for (found, expected) in [
            (mean.re, x),
            (mean.im, y),
            (covariance.xx, xx - x * x),
            (covariance.xy, xy - x * y),
            (covariance.yy, yy - y * y),
        ] {
            assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
        }
    }
}
