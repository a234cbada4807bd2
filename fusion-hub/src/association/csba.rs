//! Combined-Score Based Association: one cost from centre, dimension and orientation scores.
//!
//! The weights are those of the authors' sister paper (arXiv 2507.02430: 0.2 dimension, 0.5 centre, 0.3
//! orientation). The three scores' formulas are not public; here each is the probability that a true pair
//! would differ at least that much, given both covariances (deploy/docs/methods.md).

use super::gate::Separation;
use super::tail::{exp_minus, normal_tail};
use crate::values::Measurement;
use crate::values::PredictedMeasurement;
use serde::{Deserialize, Serialize};
use v2x_common::geometry::angle_difference;

/// Weights of the three scores.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CsbaWeights {
    /// Of the dimension score.
    pub dimension: f64,
    /// Of the centre score.
    pub centre: f64,
    /// Of the orientation score.
    pub orientation: f64,
}

impl CsbaWeights {
    /// As published; their sum is one.
    pub const PUBLISHED: Self = Self { dimension: 0.2, centre: 0.5, orientation: 0.3 };
}

/// What a detection without a track costs: as much as the worst pair, so that every pair within the gate
/// beats it, but two good matches are not broken up to save one bad one.
pub const COST_ALONE: f64 = 1.0;

/// The cost of a pair, in [0, 1]: the weighted mean of one minus each score.
pub fn pair_cost(z: &Measurement, track: &PredictedMeasurement, weights: &CsbaWeights) -> f64 {
    let centre = exp_minus(Separation::of(z, track).mahalanobis2() / 2.0);
    let dimension = exp_minus(dimension_distance2(z, track) / 2.0);
    let turn = angle_difference(z.yaw, track.yaw);
    let orientation = normal_tail(turn * turn / (z.yaw_variance + track.yaw_variance));
    let CsbaWeights { dimension: wd, centre: wc, orientation: wo } = *weights;
    (wd * (1.0 - dimension) + wc * (1.0 - centre) + wo * (1.0 - orientation)) / (wd + wc + wo)
}

/// Squared distance of the sizes, χ² with 2 degrees of freedom.
pub(super) fn dimension_distance2(z: &Measurement, track: &PredictedMeasurement) -> f64 {
    z.size_distance2(track.size, track.size_variance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::Covariance2;

    fn measurement() -> Measurement {
        Measurement {
            class: Class::Car,
            position: [0.0, 0.0],
            r: Covariance2::isotropic(0.5),
            size: [2.0, 4.0],
            relative_variance: [0.04, 0.04],
            yaw: 0.0,
            yaw_variance: 0.01,
            size_law: [None; 2],
            heading: v2x_common::detection::HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        }
    }

    fn expected() -> PredictedMeasurement {
        PredictedMeasurement {
            class: Class::Car,
            position: [0.0, 0.0],
            position_covariance: Covariance2::isotropic(0.5),
            gate_covariance: Covariance2::isotropic(0.5),
            size: [2.0, 4.0],
            size_variance: [0.16, 0.64],
            yaw: 0.0,
            yaw_variance: 0.01,
            report_probability: 0.5,
            by_positions: None,
        }
    }

    #[test]
    fn a_perfect_pair_costs_nothing_and_the_worst_pair_one() {
        let cost = pair_cost(&measurement(), &expected(), &CsbaWeights::PUBLISHED);
        assert!(cost.abs() < 1e-12);
        let far = Measurement { position: [40.0, 0.0], size: [8.0, 0.1], yaw: 3.0, ..measurement() };
        let worst = pair_cost(&far, &expected(), &CsbaWeights::PUBLISHED);
        assert!(worst > 0.95 && worst <= 1.0, "{worst}");
    }

    #[test]
    fn each_score_has_its_published_weight() {
        let turned = Measurement { yaw: 3.0, ..measurement() };
        assert!((pair_cost(&turned, &expected(), &CsbaWeights::PUBLISHED) - 0.3).abs() < 1e-9);
        let far = Measurement { position: [40.0, 0.0], ..measurement() };
        assert!((pair_cost(&far, &expected(), &CsbaWeights::PUBLISHED) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_orientation_score_is_the_two_sided_normal_tail() {
        // One standard deviation of the difference: P(|N| > 1) = 0.3173.
        let turned = Measurement { yaw: libm::sqrt(0.02), ..measurement() };
        let cost = pair_cost(&turned, &expected(), &CsbaWeights::PUBLISHED);
        assert!((cost - 0.3 * (1.0 - 0.317_310_507_862_914)).abs() < 1e-9);
    }

    #[test]
    fn the_dimension_score_weighs_each_size_by_both_variances() {
        let z = Measurement { size: [2.4, 5.0], relative_variance: [0.04, 0.09], ..measurement() };
        // The reported variance is relative to the mean of both sizes: 2.2 m and 4.5 m.
        let expected_distance2 = 0.4 * 0.4 / (0.04 * 2.2 * 2.2 + 0.16) + 1.0 / (0.09 * 4.5 * 4.5 + 0.64);
        assert!((dimension_distance2(&z, &expected()) - expected_distance2).abs() < 1e-12);
        let cost = pair_cost(&z, &expected(), &CsbaWeights::PUBLISHED);
        assert!((cost - 0.2 * (1.0 - libm::exp(-expected_distance2 / 2.0))).abs() < 1e-9, "{cost}");
    }

    #[test]
    fn the_centre_score_falls_by_half_the_squared_distance() {
        // Both covariances together are 0.5 m²: the squared distance is 2.
        let beside = Measurement { position: [1.0, 0.0], ..measurement() };
        let cost = pair_cost(&beside, &expected(), &CsbaWeights::PUBLISHED);
        assert!((cost - 0.5 * (1.0 - libm::exp(-1.0))).abs() < 1e-9, "{cost}");
    }

    #[test]
    fn only_the_ratios_of_the_weights_matter() {
        let z = Measurement { position: [1.0, 0.0], size: [2.4, 5.0], yaw: 0.2, ..measurement() };
        let doubled = CsbaWeights { dimension: 0.4, centre: 1.0, orientation: 0.6 };
        let [once, twice] =
            [CsbaWeights::PUBLISHED, doubled].map(|weights| pair_cost(&z, &expected(), &weights));
        assert!((once - twice).abs() < 1e-12);
    }
}
