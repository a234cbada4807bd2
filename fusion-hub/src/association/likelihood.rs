//! The negative log-likelihood of a pair: unbounded, so that a far box with a lucky heading never wins.
//!
//! C = m² + ln det S + min(Δθ², 12) + min(Δd², 12), in units of −2 ln p (METHODS.md 7). The caps keep one
//! outlying heading or size from outweighing the position.

use super::Expected;
use super::csba::dimension_distance2;
use super::gate::Separation;
use crate::filter::Measurement;
use v2x_common::geometry::angle_difference;

/// Most that a heading or a size can speak against a pair.
const CUE_CAP: f64 = 12.0;

/// What a detection without a track costs (METHODS.md 14).
pub const COST_ALONE: f64 = 24.0;

/// The cost of a pair. The position's density has its constant 2 ln 2π left out.
pub fn pair_cost(z: &Measurement, track: &Expected) -> f64 {
    let separation = Separation::of(z, track);
    let position = separation.mahalanobis2() + libm::log(separation.determinant);
    let turn = angle_difference(z.yaw, track.yaw);
    let heading = turn * turn / (z.yaw_variance + track.yaw_variance);
    position + heading.min(CUE_CAP) + dimension_distance2(z, track).min(CUE_CAP)
}
