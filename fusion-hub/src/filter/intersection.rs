//! Covariance intersection: fusing two estimates of one quantity whose errors have an unknown correlation.
//!
//! (ω A⁻¹ + (1 − ω) B⁻¹)⁻¹ is never less than the true error for any ω and any correlation (Julier & Uhlmann
//! 1997). It is what an ordinary update gives with A / ω for the prior and B / (1 − ω) for the report.

use crate::values::Measurement;
use v2x_common::covariance::Covariance2;

/// The weight ω in [0, 1] of `a` against `b`, both positive definite, that makes the determinant of the fused
/// covariance least. At 1 `a` alone is best, at 0 `b` alone: then there is nothing to update.
pub fn intersection_weight(a: &Covariance2, b: &Covariance2) -> f64 {
    // det(B⁻¹ + ω D) with D = A⁻¹ − B⁻¹ is to be greatest: a quadratic in ω, det B⁻¹ + ω t + ω² det D.
    let (a, b) = (information(a), information(b));
    let difference = Covariance2 { xx: a.xx - b.xx, xy: a.xy - b.xy, yy: a.yy - b.yy };
    let curvature = difference.determinant();
    let slope = b.xx * difference.yy + b.yy * difference.xx - 2.0 * b.xy * difference.xy;
    if curvature < 0.0 {
        return (-slope / (2.0 * curvature)).clamp(0.0, 1.0);
    }
    // D is definite: one of the two is more accurate in every direction, and the determinant is monotone.
    match slope.total_cmp(&0.0) {
        _ if slope == 0.0 => 0.5,
        std::cmp::Ordering::Less => 0.0,
        _ => 1.0,
    }
}

/// Errors of an agent's own track are independent again after so long, s.
const INDEPENDENT_AFTER_S: f64 = 1.0;
/// The greatest weight of what is known.
const GREATEST_WEIGHT: f64 = 0.99;

/// The weight ω of what is known, with this covariance of the position, against a report of an agent's own track: the better of
/// both counts, but a report no more than the time since the one before brings about. With the weight of a single fusion at each
/// of many reports in a second, the velocity, which no report holds, would be lost.
pub(super) fn weight_against_track(known: &Covariance2, z: &Measurement) -> f64 {
    let share = (z.since_last_s / INDEPENDENT_AFTER_S).min(1.0);
    intersection_weight(known, &z.r).max(1.0 / (1.0 + share)).min(GREATEST_WEIGHT)
}

/// The inverse.
fn information(covariance: &Covariance2) -> Covariance2 {
    let determinant = covariance.determinant();
    debug_assert!(determinant > 0.0, "must be positive definite: {covariance:?}");
    Covariance2 {
        xx: covariance.yy / determinant,
        xy: -covariance.xy / determinant,
        yy: covariance.xx / determinant,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix4, SMatrix};
    use proptest::prelude::*;

    fn covariance() -> impl Strategy<Value = Covariance2> {
        (0.05..3.0f64, 0.05..3.0f64, -0.95..0.95f64).prop_map(|(sx, sy, rho)| Covariance2 {
            xx: sx * sx,
            xy: rho * sx * sy,
            yy: sy * sy,
        })
    }

    fn matrix(covariance: &Covariance2) -> Matrix2<f64> {
        Matrix2::new(covariance.xx, covariance.xy, covariance.xy, covariance.yy)
    }

    /// Of the information at this weight.
    fn determinant(omega: f64, a: &Matrix2<f64>, b: &Matrix2<f64>) -> f64 {
        let information = a.try_inverse().unwrap() * omega + b.try_inverse().unwrap() * (1.0 - omega);
        information.determinant()
    }

    #[test]
    fn the_better_of_two_is_taken_alone_and_equals_share() {
        let (good, bad) = (Covariance2::isotropic(0.3), Covariance2::isotropic(0.9));
        assert_eq!(intersection_weight(&good, &bad), 1.0);
        assert_eq!(intersection_weight(&bad, &good), 0.0);
        assert_eq!(intersection_weight(&good, &good), 0.5);
    }

    #[test]
    fn crossed_ellipses_share_evenly() {
        let (along, across) =
            (Covariance2 { xx: 4.0, xy: 0.0, yy: 0.25 }, Covariance2 { xx: 0.25, xy: 0.0, yy: 4.0 });
        assert!((intersection_weight(&along, &across) - 0.5).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn no_other_weight_has_a_smaller_determinant(a in covariance(), b in covariance(), other in 0.0..=1.0f64) {
            let omega = intersection_weight(&a, &b);
            prop_assert!((0.0..=1.0).contains(&omega));
            let (a, b) = (matrix(&a), matrix(&b));
            let best = determinant(omega, &a, &b);
            prop_assert!(best >= determinant(other, &a, &b) * (1.0 - 1e-9));
        }

        #[test]
        fn the_fused_covariance_covers_the_error_for_any_correlation(
            a in covariance(), b in covariance(), raw in prop::array::uniform4(-1.0..1.0f64),
        ) {
            let omega = intersection_weight(&a, &b);
            let (a, b) = (matrix(&a), matrix(&b));
            // Any cross covariance is La C Lbᵀ with a contraction C.
            let raw = Matrix2::from_row_slice(&raw);
            let contraction = raw / raw.norm().max(1.0);
            let cross = a.cholesky().unwrap().l() * contraction * b.cholesky().unwrap().l().transpose();
            let mut joint = Matrix4::zeros();
            joint.fixed_view_mut::<2, 2>(0, 0).copy_from(&a);
            joint.fixed_view_mut::<2, 2>(2, 2).copy_from(&b);
            joint.fixed_view_mut::<2, 2>(0, 2).copy_from(&cross);
            joint.fixed_view_mut::<2, 2>(2, 0).copy_from(&cross.transpose());
            let (ia, ib) = (a.try_inverse().unwrap() * omega, b.try_inverse().unwrap() * (1.0 - omega));
            let fused = (ia + ib).try_inverse().unwrap();
            let mut gain = SMatrix::<f64, 2, 4>::zeros();
            gain.fixed_view_mut::<2, 2>(0, 0).copy_from(&(fused * ia));
            gain.fixed_view_mut::<2, 2>(0, 2).copy_from(&(fused * ib));
            let error = gain * joint * gain.transpose();
            let slack = (fused - error).symmetric_eigenvalues().min();
            prop_assert!(slack > -1e-9 * fused.norm(), "{slack}");
        }
    }
}
