//! 2×2 covariances factored, and how likely reports are under them.

use crate::values::Real;
use v2x_common::covariance::Covariance2;

/// A symmetric 2×2 matrix, of one object or of several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Symmetric<R = f64> {
    pub(super) xx: R,
    pub(super) xy: R,
    pub(super) yy: R,
}

impl From<Covariance2> for Symmetric {
    fn from(Covariance2 { xx, xy, yy }: Covariance2) -> Self {
        Self { xx, xy, yy }
    }
}

impl From<Symmetric> for Covariance2 {
    fn from(Symmetric { xx, xy, yy }: Symmetric) -> Self {
        Self { xx, xy, yy }
    }
}

impl<R: Real> Symmetric<R> {
    #[inline(always)]
    pub(super) fn plus(&self, other: &Self) -> Self {
        Self { xx: self.xx + other.xx, xy: self.xy + other.xy, yy: self.yy + other.yy }
    }

    #[inline(always)]
    pub(super) fn scaled(&self, factor: R) -> Self {
        Self { xx: self.xx * factor, xy: self.xy * factor, yy: self.yy * factor }
    }
}

/// A normal density at a report, but for the constant that all models share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likelihood<R = f64> {
    /// Squared Mahalanobis distance.
    pub(super) mahalanobis2: R,
    /// Determinant of the innovation's covariance.
    pub(super) determinant: R,
}

impl Likelihood {
    /// Of no report at all.
    pub(super) const CERTAIN: Self = Self { mahalanobis2: 0.0, determinant: 1.0 };
}

impl<R: Real> Likelihood<R> {
    /// A further report, given the first.
    #[inline(always)]
    pub(super) fn also(&mut self, other: Self) {
        self.mahalanobis2 += other.mahalanobis2;
        self.determinant *= other.determinant;
    }

    /// The density times exp(m²/2), m² = `mahalanobis2`.
    #[inline(always)]
    pub(super) fn relative_to(&self, mahalanobis2: R) -> R {
        ((mahalanobis2 - self.mahalanobis2) / 2.0).map(libm::exp) / self.determinant.sqrt()
    }
}

/// The least distance among models that are possible at all.
#[inline(always)]
pub(super) fn nearest<R: Real>(weights: &[R; 4], likelihoods: &[Likelihood<R>; 4]) -> R {
    let mut least = weights[0].same(f64::INFINITY);
    for (weight, Likelihood { mahalanobis2, .. }) in weights.iter().zip(likelihoods) {
        let nearer = R::choose(mahalanobis2.is_below(least), *mahalanobis2, least);
        least = R::choose(weight.same(0.0).is_below(*weight), nearer, least);
    }
    least
}

/// A positive definite matrix as L·D·Lᵀ.
///
/// By elimination, one component after the other: an inverse would cancel where the ellipse is long.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factored<R = f64> {
    slope: R,
    /// D⁻¹.
    first: R,
    second: R,
    determinant: R,
}

impl<R: Real> Factored<R> {
    #[inline(always)]
    pub(super) fn of(matrix: &Symmetric<R>) -> Self {
        let one = matrix.xx.same(1.0);
        let slope = matrix.xy / matrix.xx;
        let rest = matrix.yy - slope * matrix.xy;
        Self { slope, first: one / matrix.xx, second: one / rest, determinant: matrix.xx * rest }
    }

    /// The second component less its regression on the first one.
    #[inline(always)]
    pub(super) fn split(&self, [x, y]: [R; 2]) -> [R; 2] {
        [x, y - self.slope * x]
    }

    /// aᵀ S⁻¹ b of two split vectors.
    #[inline(always)]
    pub(super) fn product(&self, a: [R; 2], b: [R; 2]) -> R {
        a[0] * b[0] * self.first + a[1] * b[1] * self.second
    }

    /// S⁻¹ a of a split vector.
    #[inline(always)]
    pub(super) fn solve(&self, a: [R; 2]) -> [R; 2] {
        let y = a[1] * self.second;
        [a[0] * self.first - self.slope * y, y]
    }

    /// A normal density with this covariance, at a split deviation.
    #[inline(always)]
    pub(super) fn likelihood(&self, deviation: [R; 2]) -> Likelihood<R> {
        Likelihood { mahalanobis2: self.product(deviation, deviation), determinant: self.determinant }
    }
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
        let covariance = Symmetric { xx: 3.0, xy: -1.0, yy: 5.0 };
        assert_eq!(covariance.scaled(2.0), Symmetric { xx: 6.0, xy: -2.0, yy: 10.0 });
    }
}
