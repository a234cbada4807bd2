//! The negative log-likelihood of a pair: unbounded, so that a far box with a lucky heading never wins.
//!
//! C = m² + ln det S + min(Δθ², 12) + min(Δd², 12), in units of −2 ln p (METHODS.md 7). The caps keep one
//! outlying heading or size from outweighing the position.

use super::csba::dimension_distance2;
use crate::filter::{Measurement, PositionInnovation, State};
use v2x_common::geometry::angle_difference;

/// Most that a heading or a size can speak against a pair.
const CUE_CAP: f64 = 12.0;

/// What a detection without a track costs (METHODS.md 14).
pub const COST_ALONE: f64 = 24.0;

/// The cost of a pair with this innovation of the position.
pub fn pair_cost(z: &Measurement, state: &State, innovation: &PositionInnovation) -> f64 {
    let turn = angle_difference(z.yaw, state.heading.mean);
    let heading = turn * turn / (z.yaw_variance + state.heading.variance);
    // −2 ln of the normal density, less its constant 2 ln 2π.
    let position = -2.0 * innovation.ln_likelihood - 2.0 * libm::log(2.0 * std::f64::consts::PI);
    position + heading.min(CUE_CAP) + dimension_distance2(z, state).min(CUE_CAP)
}
