//! The displacement of a body with Gaussian heading, speed and turn rate.
//!
//! In the complex plane a step is (v·t + i·u·t)·exp(i h), with speed v, sideways speed u of the centre and
//! heading h half-way: polynomials in Gaussians times exp(i h), whose means and covariances are known in
//! closed form (Stein's lemma, and E[f(X) exp(i h)] = exp(i h̄ − σ²/2)·E[f(X + i·cov(X, h))]). They are the
//! integrals that a cubature filter (Arasaratnam & Haykin 2009) approximates by ten points, without the
//! points.

use super::gaussian::{Full, SPEED, TURN, YAW, at};
use super::likelihood::Symmetric;
use crate::values::{Real, share_lost};

/// A complex number: east and north.
#[derive(Clone, Copy, Debug)]
pub(super) struct Complex<R = f64> {
    pub(super) re: R,
    pub(super) im: R,
}

impl<R: Real> Complex<R> {
    #[inline(always)]
    const fn new(re: R, im: R) -> Self {
        Self { re, im }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self::new(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)
    }

    #[inline(always)]
    fn scaled(self, factor: R) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }

    #[inline(always)]
    fn norm2(self) -> R {
        self.re * self.re + self.im * self.im
    }

    #[inline(always)]
    fn times_i(self) -> Self {
        Self::new(-self.im, self.re)
    }
}

/// Moments of D = (along·v + i·aside·ω)·exp(i h), h = θ + ahead·ω.
pub(super) struct Displacement<R = f64> {
    pub(super) mean: Complex<R>,
    pub(super) covariance: Symmetric<R>,
    /// Cov(s, D) for every component s of the state.
    pub(super) cross: [Complex<R>; 5],
    /// E[exp(i h)].
    pub(super) direction: Complex<R>,
    /// E[exp(2 i h)].
    pub(super) axis: Complex<R>,
}

impl<R: Real> Displacement<R> {
    #[inline(always)]
    pub(super) fn of(state: &Full<R>, along: R, aside: R, ahead: R) -> Self {
        let entry = |row, column| state.covariance[at(row, column)];
        let mut with_h = [along; 5];
        for (s, with_h) in with_h.iter_mut().enumerate() {
            *with_h = entry(s, YAW) + ahead * entry(s, TURN);
        }
        let variance_h = with_h[YAW] + ahead * with_h[TURN];
        let (sin, cos) = (state.mean[YAW] + ahead * state.mean[TURN]).map_two(libm::sincos);
        // exp(−σ²) − 1: what follows is arranged so that nothing cancels at any speed.
        let lost = -share_lost(variance_h);
        let squared = lost + 1.0;
        let shrunk = squared.sqrt();
        let direction = Complex::new(cos * shrunk, sin * shrunk);
        let axis = direction.times(direction).scaled(squared);
        let tilt = Complex::new(along * with_h[SPEED], aside * with_h[TURN]).times_i();
        let amplitude = Complex::new(along * state.mean[SPEED], aside * state.mean[TURN]).plus(tilt);
        let mean = direction.times(amplitude);
        let (vv, uu) = (along * along * entry(SPEED, SPEED), aside * aside * entry(TURN, TURN));
        let vu = along * aside * entry(SPEED, TURN);
        // E[D²] − E[D]² and E|D|² − |E[D]|².
        let twice = amplitude.re.same(2.0);
        let tilted = amplitude.scaled(twice).plus(tilt).times(tilt).plus(Complex::new(vv - uu, vu * 2.0));
        let pseudo = direction
            .times(direction)
            .times(amplitude.times(amplitude).scaled(lost).plus(tilted.scaled(squared)));
        let power = tilt.norm2() - (amplitude.re * tilt.re + amplitude.im * tilt.im) * 2.0 + vv + uu
            - amplitude.norm2() * lost;
        let covariance =
            Symmetric { xx: (power + pseudo.re) / 2.0, xy: pseudo.im / 2.0, yy: (power - pseudo.re) / 2.0 };
        let mut cross = [mean; 5];
        for (s, cross) in cross.iter_mut().enumerate() {
            let linear = Complex::new(along * entry(s, SPEED), aside * entry(s, TURN));
            *cross = direction.times(linear).plus(mean.times_i().scaled(with_h[s]));
        }
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
