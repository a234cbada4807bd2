//! The posterior of a size by reports whose law is declared, under a prior.

use super::log_normal::LogNormal;

/// Square of the skewness up to which a series is exact to 1 % of a standard deviation (test).
const NEARLY_NORMAL: f64 = 0.09;

/// Variances between maximum and bound, from which on the bound does not matter.
const CLEAR_OF_BOUND: f64 = 12.0;

/// Steps of the quadrature; the error is below 1 % of a standard deviation (test).
const STEPS: u32 = 16;

/// The density is neglected below exp(−12) of its maximum.
const DEPTH: f64 = 12.0;

/// So near, in ln s, exp is a short series.
const NEAR_BY: f64 = 0.0625;

/// The right side falls more slowly than a parabola, by up to this factor.
const RIGHT_TAIL: f64 = 1.6;

/// A logarithm of a size, relative to the origin of a [`Posterior`], and exp of minus it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) u: f64,
    pub(super) w: f64,
}

impl Spot {
    const ORIGIN: Self = Self { u: 0.0, w: 1.0 };

    /// At another logarithm: where that is near, by a series that is exact to 1e-12 of it.
    #[inline]
    fn moved(self, u: f64) -> Self {
        let step = self.u - u;
        if step.abs() > NEAR_BY {
            return Self { u, w: libm::exp(-u) };
        }
        // 1 + x (1 + x/2 (1 + x/3 (...))), without a division.
        let series = [1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0, 1.0];
        let series =
            series.into_iter().fold(1.0 + step * (1.0 / 6.0), |series, part| 1.0 + step * part * series);
        Self { u, w: self.w * series }
    }
}

/// ln of the density of u = ln s, relative to `origin`, the likelihood's own maximum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Posterior {
    /// A/s², B/s and n at the origin.
    squares: f64,
    sum: f64,
    count: f64,
    /// Of the prior, relative to the origin.
    prior_mean: f64,
    prior_precision: f64,
    pub(super) origin: f64,
    /// 1/s at the origin, 1/m.
    pub(super) w: f64,
    /// Largest u, relative to the origin.
    most: f64,
}

impl Posterior {
    /// Without reports.
    pub(super) const NONE: Self = Self {
        squares: 0.0,
        sum: 0.0,
        count: 0.0,
        prior_mean: 0.0,
        prior_precision: 0.0,
        origin: 0.0,
        w: 1.0,
        most: f64::INFINITY,
    };

    /// Without a prior, of A (m²), B (m), n and the largest possible size (m) of the evidence.
    pub(super) fn of([squares, sum, count, most]: [f64; 4]) -> Self {
        // The likelihood's maximum: the positive root of A w² − B w − n, w = 1/s.
        let w = (sum + libm::sqrt(sum * sum + 4.0 * squares * count)) / (2.0 * squares);
        let most = if most < f64::INFINITY { libm::log(most * w) } else { f64::INFINITY };
        Self { squares: squares * w * w, sum: sum * w, count, origin: -libm::log(w), w, most, ..Self::NONE }
    }

    /// Under a prior.
    pub(super) fn under(&self, prior: Option<&LogNormal>) -> Self {
        let Some(prior) = prior else { return *self };
        Self { prior_mean: prior.mean_ln - self.origin, prior_precision: 1.0 / prior.variance_ln, ..*self }
    }

    /// Mean and variance of ln s.
    pub(super) fn moments(&self) -> LogNormal {
        let peak = self.peak();
        self.expanded(peak).unwrap_or_else(|| self.integrated(peak))
    }

    /// First derivative and minus the second one at u, where exp(−u) = w.
    fn derivatives(&self, u: f64, w: f64) -> (f64, f64) {
        let (a, b) = (self.squares * w * w, self.sum * w);
        let slope = a - b - self.count - (u - self.prior_mean) * self.prior_precision;
        (slope, 2.0 * a - b + self.prior_precision)
    }

    /// The maximum within the bound.
    pub(super) fn peak(&self) -> Spot {
        // The maximum lies between those of likelihood and prior; from the left Newton cannot overshoot it.
        let mut u = if self.prior_precision > 0.0 { self.prior_mean.min(0.0) } else { 0.0 };
        if self.prior_precision > 0.0 {
            // A weighted mean is near it; the first iteration corrects a step too far to the right.
            let information = 2.0 * self.squares - self.sum;
            let near = self.prior_mean * self.prior_precision / (information + self.prior_precision);
            u = u.max(near.min(self.most));
        }
        let mut spot = Spot::ORIGIN.moved(u);
        for _ in 0..8 {
            let (slope, curvature) = self.derivatives(spot.u, spot.w);
            // Where the right tail is convex, the prior's precision and the likelihood's slope lead back.
            let step = slope / curvature.max(self.count.max(self.prior_precision));
            spot = spot.moved((spot.u + step).min(self.most));
            if step.abs() < 1e-3 {
                break;
            }
        }
        spot
    }

    /// By Laplace's method to the next order, where the posterior is nearly normal and no bound is near.
    ///
    /// About a maximum with −ℓ'' = 1/σ²: mean σ⁴ ℓ'''/2, variance σ² + σ⁶ ℓ''''/2 + σ⁸ ℓ'''².
    fn expanded(&self, Spot { u: peak, w }: Spot) -> Option<LogNormal> {
        let (a, b) = (self.squares * w * w, self.sum * w);
        let (_, curvature) = self.derivatives(peak, w);
        let (third, fourth) = (4.0 * a - b, b - 8.0 * a);
        let variance = 1.0 / curvature;
        let skew2 = third * third * variance * variance * variance;
        let room = self.most - peak;
        let is_normal = curvature > 0.0 && skew2 < NEARLY_NORMAL && room * room > CLEAR_OF_BOUND * variance;
        is_normal.then(|| LogNormal {
            mean_ln: self.origin + peak + third * variance * variance / 2.0,
            variance_ln: variance * (1.0 + fourth * variance * variance / 2.0 + skew2),
        })
    }

    /// By quadrature over where the posterior is not negligible.
    fn integrated(&self, Spot { u: peak, w }: Spot) -> LogNormal {
        let (slope, curvature) = self.derivatives(peak, w);
        let curvature = curvature.max(self.prior_precision.max(self.count / 2.0));
        // The density rises up to a bound: it then falls off to the left faster than a parabola.
        let slope = slope.max(0.0);
        let left = (libm::sqrt(slope * slope + 2.0 * DEPTH * curvature) - slope) / curvature;
        let right = (RIGHT_TAIL * libm::sqrt(2.0 * DEPTH / curvature)).min(self.most - peak);
        let step = (left + right) / f64::from(STEPS);
        let (a, b) = (self.squares * w * w / 2.0, self.sum * w);
        let ratio = libm::exp(-step);
        let mut falling = libm::exp(left);
        let (mut zeroth, mut first, mut second) = (0.0, 0.0, 0.0);
        for index in 0..=STEPS {
            let off = f64::from(index) * step - left;
            let from_prior = off * (off / 2.0 + peak - self.prior_mean) * self.prior_precision;
            // Relative to the peak, and factored, so that nothing cancels however many the reports.
            let change = falling - 1.0;
            let ln_density = change * (b - a * (falling + 1.0)) - self.count * off - from_prior;
            // Simpson's rule.
            let factor = if index == 0 || index == STEPS { 1.0 } else { 2.0 + 2.0 * f64::from(index % 2) };
            let density = factor * libm::exp(ln_density);
            zeroth += density;
            first += density * off;
            second += density * off * off;
            falling *= ratio;
        }
        let mean = first / zeroth;
        LogNormal { mean_ln: self.origin + peak + mean, variance_ln: second / zeroth - mean * mean }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spot_that_is_moved_has_the_exponential_whether_near_or_far() {
        for step in -40..=40 {
            let u = 0.01 * f64::from(step);
            let from = Spot::ORIGIN.moved(0.3);
            for spot in [Spot::ORIGIN.moved(u), from.moved(0.3 + u)] {
                assert!((spot.w / libm::exp(-spot.u) - 1.0).abs() < 2e-12, "{spot:?}");
            }
        }
    }
}
