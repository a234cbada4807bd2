//! CSBA association and weighted least squares (Fadili 2025; deploy/docs/methods.md).
//!
//! The association is that of the engine between two frames of one instant: class and χ² gate, then the pairs of
//! least combined cost. Its window of 100 ms is the caller's: its frames are one instant here.

use super::pairing::fold;
use super::report::{Fused, Report};
use crate::association::csba::{CsbaWeights, pair_cost};
use crate::values::PredictedMeasurement;
use crate::values::{Measurement, PositionInnovation};
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::{angle_difference, wrap_angle};

/// The gate on the squared Mahalanobis distance of centres: 0.9997 of true pairs (deploy/docs/methods.md).
const GATE: f64 = 16.2;

/// Pairs by CSBA, merged by least squares.
pub fn fuse(agents: &[&[Report]]) -> Vec<Fused> {
    fold(agents, cost, |one, report| {
        one.z = least_squares(&one.z, &report.z);
        one.score = one.score.max(report.score);
    })
}

fn cost(one: &Fused, report: &Report) -> Option<f64> {
    let (a, b) = (&one.z, &report.z);
    let s = Covariance2 { xx: a.r.xx + b.r.xx, xy: a.r.xy + b.r.xy, yy: a.r.yy + b.r.yy };
    let difference = [b.position[0] - a.position[0], b.position[1] - a.position[1]];
    let is_near = PositionInnovation::new(difference, &s).mahalanobis2 <= GATE;
    is_near.then(|| pair_cost(b, &expected(a, b), &CsbaWeights::PUBLISHED))
}

/// A box as the predicted measurement of the other one. Both size errors are relative to the mean of both sizes
/// (deploy/docs/methods.md).
fn expected(z: &Measurement, other: &Measurement) -> PredictedMeasurement {
    let variance = |axis: usize| {
        let middle = (z.size[axis] + other.size[axis]) / 2.0;
        z.relative_variance[axis] * middle * middle
    };
    PredictedMeasurement {
        class: z.class,
        position: z.position,
        position_covariance: z.r,
        gate_covariance: z.r,
        size: z.size,
        size_variance: [variance(0), variance(1)],
        yaw: z.yaw,
        yaw_variance: z.yaw_variance,
        report_probability: 0.5,
        by_positions: None,
    }
}

/// Both boxes weighted by the inverse of their covariances. Sizes are weighted by their relative variances: with
/// the measured size in the weight, sizes measured too small would have more weight (deploy/docs/methods.md).
fn least_squares(a: &Measurement, b: &Measurement) -> Measurement {
    let (position, r) = weighted_position(a, b);
    let mut z = *a;
    (z.position, z.r) = (position, r);
    for axis in 0..2 {
        let (va, vb) = (a.relative_variance[axis], b.relative_variance[axis]);
        z.size[axis] = (a.size[axis] * vb + b.size[axis] * va) / (va + vb);
        z.relative_variance[axis] = va * vb / (va + vb);
    }
    let (va, vb) = (a.yaw_variance, b.yaw_variance);
    z.yaw = wrap_angle(a.yaw + angle_difference(b.yaw, a.yaw) * va / (va + vb));
    z.yaw_variance = va * vb / (va + vb);
    z.velocity = None;
    z
}

/// p = a + A (A + B)⁻¹ (b − a), with covariance A (A + B)⁻¹ B.
fn weighted_position(a: &Measurement, b: &Measurement) -> ([f64; 2], Covariance2) {
    let (pa, pb) = (a.r, b.r);
    let s = Covariance2 { xx: pa.xx + pb.xx, xy: pa.xy + pb.xy, yy: pa.yy + pb.yy };
    let determinant = s.determinant();
    let inverse = Covariance2 { xx: s.yy / determinant, xy: -s.xy / determinant, yy: s.xx / determinant };
    // The rows of A (A + B)⁻¹.
    let gain = [
        [pa.xx * inverse.xx + pa.xy * inverse.xy, pa.xx * inverse.xy + pa.xy * inverse.yy],
        [pa.xy * inverse.xx + pa.yy * inverse.xy, pa.xy * inverse.xy + pa.yy * inverse.yy],
    ];
    let difference = [b.position[0] - a.position[0], b.position[1] - a.position[1]];
    let position = std::array::from_fn(|axis| {
        a.position[axis] + gain[axis][0] * difference[0] + gain[axis][1] * difference[1]
    });
    let xy = |row: usize| gain[row][0] * pb.xy + gain[row][1] * pb.yy;
    let r = Covariance2 {
        xx: gain[0][0] * pb.xx + gain[0][1] * pb.xy,
        // Symmetric but for rounding.
        xy: (xy(0) + gain[1][0] * pb.xx + gain[1][1] * pb.xy) / 2.0,
        yy: xy(1),
    };
    (position, r)
}

#[cfg(test)]
mod tests {
    use super::super::Rule;
    use super::super::testing::{close, report, sized};
    use super::*;

    #[test]
    fn components_are_weighted_by_inverse_variance() {
        let a = report(0.0, 0.0);
        let mut b = sized(report(1.0, 2.0), [1.0, 6.0], 0.3);
        // A quarter of the first one's information in position and size, the same in heading.
        b.z.r = Covariance2::isotropic(1.0);
        b.z.relative_variance = [0.16; 2];
        let fused = Rule::CsbaWls.fuse(&[&[a], &[b]]);
        assert_eq!(fused.len(), 1);
        let z = fused[0].z;
        assert!(close(z.position[0], 0.2) && close(z.position[1], 0.4));
        assert!(close(z.size[0], 1.8) && close(z.size[1], 4.4));
        assert!(close(z.yaw, 0.15));
        assert!(close(z.r.xx, 0.2) && close(z.r.yy, 0.2) && close(z.r.xy, 0.0));
        assert!(close(z.relative_variance[0], 0.032) && close(z.yaw_variance, 0.005));
    }

    #[test]
    fn full_covariances_are_weighted_as_matrices() {
        let (mut a, mut b) = (report(0.0, 0.0), report(1.0, 0.0));
        a.z.r = Covariance2 { xx: 2.0, xy: 1.0, yy: 2.0 };
        b.z.r = Covariance2 { xx: 1.0, xy: 0.0, yy: 1.0 };
        let z = Rule::CsbaWls.fuse(&[&[a], &[b]])[0].z;
        // A + B = [3 1; 1 3], its inverse [3 −1; −1 3] / 8; A times that: [5 1; 1 5] / 8.
        assert!(close(z.position[0], 0.625) && close(z.position[1], 0.125));
        assert!(close(z.r.xx, 0.625) && close(z.r.xy, 0.125) && close(z.r.yy, 0.625));
    }

    #[test]
    fn the_gate_is_in_standard_deviations() {
        // Both σ 0.5 m: 0.5 · 16.2 = 8.1 m².
        let a = [report(0.0, 0.0)];
        assert_eq!(Rule::CsbaWls.fuse(&[&a, &[report(libm::sqrt(8.09), 0.0)]]).len(), 1);
        assert_eq!(Rule::CsbaWls.fuse(&[&a, &[report(libm::sqrt(8.11), 0.0)]]).len(), 2);
    }

    #[test]
    fn the_heading_separates_neighbours() {
        let (north, south) = (1.5, -1.5);
        let a = [sized(report(0.0, 0.0), [2.0, 4.0], north), sized(report(1.0, 0.0), [2.0, 4.0], south)];
        let b = [sized(report(0.4, 0.0), [2.0, 4.0], south), sized(report(0.6, 0.0), [2.0, 4.0], north)];
        let fused = Rule::CsbaWls.fuse(&[&a, &b]);
        assert_eq!(fused.len(), 2);
        assert!(fused.iter().all(|one| one.members[0].index != one.members[1].index));
    }
}
