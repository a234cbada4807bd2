//! Combined-Score Based Association: one cost from centre, dimension and orientation scores.
//!
//! The weights are those of the authors' sister paper (arXiv 2507.02430: 0.2 dimension, 0.5 centre, 0.3
//! orientation). The three scores' formulas are not public; here each is the probability that a true pair
//! would differ at least that much, given both covariances (METHODS.md 7, assumptions A1-A5).

use crate::filter::{Measurement, State};
use v2x_common::geometry::angle_difference;

/// Weights of the three scores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CsbaWeights {
    /// Of the dimension score.
    pub dimension: f64,
    /// Of the centre score.
    pub centre: f64,
    /// Of the orientation score.
    pub orientation: f64,
}

impl CsbaWeights {
    /// As published.
    pub const PUBLISHED: Self = Self { dimension: 0.2, centre: 0.5, orientation: 0.3 };
}

/// What a detection without a track costs: as much as the worst pair, so that every pair within the gate
/// beats it, but two good matches are not broken up to save one bad one.
pub const COST_ALONE: f64 = 1.0;

/// The cost in [0, 1] of a pair whose centres are `mahalanobis2` apart: the weighted mean of one minus each
/// score.
pub fn pair_cost(z: &Measurement, state: &State, mahalanobis2: f64, weights: &CsbaWeights) -> f64 {
    let centre = libm::exp(-mahalanobis2 / 2.0);
    let dimension = libm::exp(-dimension_distance2(z, state) / 2.0);
    let turn = angle_difference(z.yaw, state.heading.mean);
    let orientation = libm::erfc(turn.abs() / libm::sqrt(2.0 * (z.yaw_variance + state.heading.variance)));
    let CsbaWeights { dimension: wd, centre: wc, orientation: wo } = *weights;
    (wd * (1.0 - dimension) + wc * (1.0 - centre) + wo * (1.0 - orientation)) / (wd + wc + wo)
}

/// Squared distance of the sizes, χ² with 2 degrees of freedom.
pub(super) fn dimension_distance2(z: &Measurement, state: &State) -> f64 {
    let pairs =
        [(z.size[0], z.relative_variance[0], state.width), (z.size[1], z.relative_variance[1], state.depth)];
    pairs
        .into_iter()
        .map(|(reported, relative_variance, size)| {
            let middle = (reported + size.mean) / 2.0;
            let difference = reported - size.mean;
            difference * difference / (relative_variance * middle * middle + size.variance)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::Covariance2;
    use v2x_common::time::Timestamp;

    fn measurement() -> Measurement {
        Measurement {
            class: Class::Car,
            position: [0.0, 0.0],
            r: Covariance2::isotropic(0.5),
            size: [2.0, 4.0],
            relative_variance: [0.04, 0.04],
            yaw: 0.0,
            yaw_variance: 0.01,
            velocity: None,
        }
    }

    #[test]
    fn a_perfect_pair_costs_nothing_and_the_worst_pair_one() {
        let z = measurement();
        let state = State::born(Timestamp::EPOCH, &z);
        assert!(pair_cost(&z, &state, 0.0, &CsbaWeights::PUBLISHED).abs() < 1e-12);
        let far = Measurement { size: [8.0, 0.1], yaw: 3.0, ..z };
        let worst = pair_cost(&far, &state, 1e3, &CsbaWeights::PUBLISHED);
        assert!(worst > 0.95 && worst <= 1.0, "{worst}");
    }

    #[test]
    fn each_score_has_its_published_weight() {
        let z = measurement();
        let state = State::born(Timestamp::EPOCH, &z);
        let turned = Measurement { yaw: 3.0, ..z };
        assert!((pair_cost(&turned, &state, 0.0, &CsbaWeights::PUBLISHED) - 0.3).abs() < 1e-9);
        assert!((pair_cost(&z, &state, 1e3, &CsbaWeights::PUBLISHED) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_orientation_score_is_the_two_sided_normal_tail() {
        let z = measurement();
        let state = State::born(Timestamp::EPOCH, &z);
        // One standard deviation of the difference: P(|N| > 1) = 0.3173.
        let turned = Measurement { yaw: libm::sqrt(0.02), ..z };
        let cost = pair_cost(&turned, &state, 0.0, &CsbaWeights::PUBLISHED);
        assert!((cost - 0.3 * (1.0 - 0.317_310_507_862_914)).abs() < 1e-9);
    }
}
