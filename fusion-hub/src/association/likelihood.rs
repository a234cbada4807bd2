//! The negative log-likelihood of a pair: unbounded, so that a distant box with a similar heading is never preferred.
//!
//! C = m² + ln det S + min(Δθ², 12) + min(Δd², 12), in units of −2 ln p (deploy/docs/methods.md). The caps keep one
//! outlying heading or size from outweighing the position.

use super::class_cost::class_cost;
use super::config::{AssociationConfig, ClassRule};
use super::csba::dimension_distance2;
use super::gate::Separation;
use crate::values::Measurement;
use crate::values::{ExpectedPlace, PredictedMeasurement};
use std::f64::consts::{FRAC_PI_2, PI};
use v2x_common::geometry::angle_difference;

/// Upper limit of the cost of a heading, a size or a low report probability.
const CUE_CAP: f64 = 12.0;

/// What a detection without a track costs (deploy/docs/methods.md).
pub const COST_ALONE: f64 = 24.0;

/// What a track's report costs beside the pair, where several tracks compete for it: −2 ln of the odds that the
/// frame reports the track, which it does with this probability. Without it a track without detections for a
/// while would take the reports of one that is detected regularly, which would then be initiated again.
pub fn report_cost(probability: f64) -> f64 {
    let odds = probability / (1.0 - probability);
    (-2.0 * libm::log(odds)).min(CUE_CAP)
}

/// What a heading costs that is turned by half a turn, or by a quarter with width and depth exchanged: -2 ln of their
/// probabilities, about.
const REVERSED_COST: f64 = 7.8;
const SWAPPED_COST: f64 = 10.0;
/// It costs nothing that an object does not move along its heading where that is not known: from this variance on, rad².
const UNKNOWN_HEADING: f64 = 1.0;

/// The cost of a pair; of the settings, how headings and classes err counts. The position's density has its constant 2 ln 2π left out.
pub fn pair_cost(z: &Measurement, track: &PredictedMeasurement, config: &AssociationConfig) -> f64 {
    let separation = Separation::of(z, track);
    let position = separation.mahalanobis2() + libm::log(separation.determinant);
    let position = match &track.by_positions {
        Some(place) if config.turned_headings => position.min(sideways_cost(z, track, place)),
        _ => position,
    };
    let turn = angle_difference(z.yaw, track.yaw);
    let heading = turn * turn / (z.yaw_variance + track.yaw_variance);
    let size = dimension_distance2(z, track).min(CUE_CAP);
    // Where classes are seldom taken for each other, sizes that differ have been left out.
    let size = match config.classes {
        ClassRule::Evidence => size + class_cost(z.class, track.class, &config.class_law),
        ClassRule::Exact | ClassRule::Ignored => size,
    };
    let cues = heading.min(CUE_CAP) + size;
    if config.turned_headings && heading > REVERSED_COST && track.class.has_front() {
        return position + turned_cost(z, track, turn.abs(), size).min(cues);
    }
    position + cues
}

/// The cost of a position where the track does not move along its heading.
fn sideways_cost(z: &Measurement, track: &PredictedMeasurement, place: &ExpectedPlace) -> f64 {
    let separation = Separation::of_place(z, place);
    let of_heading = if track.yaw_variance < UNKNOWN_HEADING { ExpectedPlace::COST } else { 0.0 };
    separation.mahalanobis2() + libm::log(separation.determinant) + of_heading
}

/// The cost of heading and size, where the heading is turned.
#[cold]
fn turned_cost(z: &Measurement, track: &PredictedMeasurement, turn: f64, size: f64) -> f64 {
    let variance = z.yaw_variance + track.yaw_variance;
    let (back, quarter) = (PI - turn, FRAC_PI_2 - turn);
    let reversed = (back * back / variance + REVERSED_COST).min(CUE_CAP) + size;
    let swapped = (quarter * quarter / variance).min(CUE_CAP)
        + SWAPPED_COST
        + dimension_distance2(&z.exchanged(), track).min(CUE_CAP);
    reversed.min(swapped)
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("association.cue_cap", CUE_CAP.to_string()),
        ("association.cost_alone", COST_ALONE.to_string()),
        (
            "association.turned_headings",
            format!(
                "reversed {REVERSED_COST}, swapped {SWAPPED_COST}, sideways {} (below {UNKNOWN_HEADING} rad2)",
                ExpectedPlace::COST
            ),
        ),
    ]
}
