//! 2×2 covariances factored, and how likely reports are under them.

use v2x_common::covariance::Covariance2;

/// A normal density at a report, but for the constant that all models share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likelihood {
    /// Squared Mahalanobis distance.
    pub(super) mahalanobis2: f64,
    /// Determinant of the innovation's covariance.
    pub(super) determinant: f64,
}

impl Likelihood {
    /// Of no report at all.
    pub(super) const CERTAIN: Self = Self { mahalanobis2: 0.0, determinant: 1.0 };

    /// A further report, given the first.
    pub(super) fn also(&mut self, other: Self) {
        self.mahalanobis2 += other.mahalanobis2;
        self.determinant *= other.determinant;
    }

    /// The density times exp(m²/2), m² = `mahalanobis2`.
    pub(super) fn relative_to(&self, mahalanobis2: f64) -> f64 {
        libm::exp((mahalanobis2 - self.mahalanobis2) / 2.0) / libm::sqrt(self.determinant)
    }
}

/// The least distance among models that are possible at all.
pub(super) fn nearest(weights: &[f64; 4], likelihoods: &[Likelihood; 4]) -> f64 {
    likelihoods
        .iter()
        .zip(weights)
        .filter(|(_, weight)| **weight > 0.0)
        .fold(f64::INFINITY, |least, (likelihood, _)| least.min(likelihood.mahalanobis2))
}

/// A covariance times a factor.
pub(super) fn scaled(covariance: &Covariance2, factor: f64) -> Covariance2 {
    let Covariance2 { xx, xy, yy } = *covariance;
    Covariance2 { xx: xx * factor, xy: xy * factor, yy: yy * factor }
}

/// A positive definite matrix as L·D·Lᵀ.
///
/// By elimination, one component after the other: an inverse would cancel where the ellipse is long.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factored {
    slope: f64,
    /// D⁻¹.
    first: f64,
    second: f64,
    determinant: f64,
}

impl Factored {
    pub(super) fn of(matrix: &Covariance2) -> Self {
        let slope = matrix.xy / matrix.xx;
        let rest = matrix.yy - slope * matrix.xy;
        Self { slope, first: 1.0 / matrix.xx, second: 1.0 / rest, determinant: matrix.xx * rest }
    }

    /// The second component less its regression on the first one.
    pub(super) fn split(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x, y - self.slope * x]
    }

    /// aᵀ S⁻¹ b of two split vectors.
    pub(super) fn product(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        a[0] * b[0] * self.first + a[1] * b[1] * self.second
    }

    /// S⁻¹ a of a split vector.
    pub(super) fn solve(&self, a: [f64; 2]) -> [f64; 2] {
        let y = a[1] * self.second;
        [a[0] * self.first - self.slope * y, y]
    }

    /// A normal density with this covariance, at a split deviation.
    pub(super) fn likelihood(&self, deviation: [f64; 2]) -> Likelihood {
        Likelihood { mahalanobis2: self.product(deviation, deviation), determinant: self.determinant }
    }
}

/// The sum of two covariances.
pub(super) fn sum(a: &Covariance2, b: &Covariance2) -> Covariance2 {
    Covariance2 { xx: a.xx + b.xx, xy: a.xy + b.xy, yy: a.yy + b.yy }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_density_is_that_of_the_normal_distribution_but_for_a_common_factor() {
        let of = |mahalanobis2, determinant| Likelihood { mahalanobis2, determinant };
        let ratio = of(3.0, 0.25).relative_to(2.0) / of(5.0, 4.0).relative_to(2.0);
        assert!((ratio - libm::exp(1.0) * 4.0).abs() < 1e-12, "{ratio}");
    }

    #[test]
    fn densities_are_relative_to_the_nearest_possible_model_so_that_none_underflows_alone() {
        let likelihoods =
            [10.0, 9000.0, 8000.0, 8500.0].map(|mahalanobis2| Likelihood { mahalanobis2, determinant: 1.0 });
        assert_eq!(nearest(&[0.0, 0.5, 0.3, 0.2], &likelihoods), 8000.0);
    }

    #[test]
    fn every_element_of_a_covariance_is_scaled() {
        let covariance = Covariance2 { xx: 3.0, xy: -1.0, yy: 5.0 };
        assert_eq!(scaled(&covariance, 2.0), Covariance2 { xx: 6.0, xy: -2.0, yy: 10.0 });
    }
}
