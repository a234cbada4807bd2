//! GOSPA: one figure in metres for localisation errors, missed and false objects together.
//!
//! Rahmathullah, García-Fernández & Svensson, "Generalized optimal sub-pattern assignment metric",
//! FUSION 2017, eq. (1) with p = 2 and α = 2: over all assignments, the least
//! `sqrt(Σ d² + c²/2 · (missed + false))`, where only pairs nearer than the cut-off c are assigned.

use crate::score::errors::distance_m;
use serde::{Deserialize, Serialize};
use v2x_common::geometry::BevBox;
use v2x_fusion_hub::association::assignment::{Assigner, Candidate};

/// Squared GOSPA of one frame by cause, m². The parts add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GospaParts {
    /// Σ d² over the assigned pairs.
    pub localisation_m2: f64,
    /// c²/2 for every true object without a pair.
    pub missed_m2: f64,
    /// c²/2 for every estimate without a pair.
    pub false_m2: f64,
}

impl GospaParts {
    /// The metric itself, m.
    pub fn distance_m(&self) -> f64 {
        libm::sqrt(self.localisation_m2 + self.missed_m2 + self.false_m2)
    }
}

/// GOSPA of two sets of positions with cut-off `cutoff_m`.
#[expect(clippy::cast_precision_loss, reason = "counts of objects")]
pub(crate) fn gospa(
    predictions: &[BevBox],
    truth: &[BevBox],
    cutoff_m: f64,
    assigner: &mut Assigner,
) -> GospaParts {
    let cutoff_m2 = cutoff_m * cutoff_m;
    let mut candidates = Vec::new();
    for (row, prediction) in (0u32..).zip(predictions) {
        for (col, object) in (0u32..).zip(truth) {
            let distance = distance_m(prediction, object);
            if distance < cutoff_m {
                candidates.push(Candidate { row, col, cost: distance * distance });
            }
        }
    }
    // An estimate without a pair leaves an object without a pair, too: c²/2 each.
    let columns = assigner.solve(predictions.len(), truth.len(), &candidates, cutoff_m2);
    let (mut localisation_m2, mut pairs) = (0.0, 0);
    for (prediction, column) in predictions.iter().zip(columns) {
        if let Some(column) = column {
            let distance = distance_m(prediction, &truth[*column as usize]);
            localisation_m2 += distance * distance;
            pairs += 1;
        }
    }
    GospaParts {
        localisation_m2,
        missed_m2: cutoff_m2 / 2.0 * (truth.len() - pairs) as f64,
        false_m2: cutoff_m2 / 2.0 * (predictions.len() - pairs) as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::predicted;
    use proptest::prelude::*;

    fn of(predictions: &[f64], truth: &[f64], cutoff_m: f64) -> GospaParts {
        let boxes = |xs: &[f64]| xs.iter().map(|x| predicted(*x, 0.0)).collect::<Vec<_>>();
        gospa(&boxes(predictions), &boxes(truth), cutoff_m, &mut Assigner::default())
    }

    #[test]
    fn errors_misses_and_false_objects_add_in_squares() {
        // Pairs at 3 m and 1 m: 9 + 1. One miss, two false: 3 × 5²/2. Sum 10 + 37.5 = 47.5.
        let parts = of(&[3.0, 101.0, 50.0, 60.0], &[0.0, 100.0, 200.0], 5.0);
        assert_eq!(parts, GospaParts { localisation_m2: 10.0, missed_m2: 12.5, false_m2: 25.0 });
        assert!((parts.distance_m() - 6.892_024_376_045_111).abs() < 1e-12);
    }

    #[test]
    fn one_accurate_pair_costs_less_than_two_pairs_near_the_cutoff() {
        // Two pairs of 1.9 m: 7.22. One pair of 0.1 m, a miss and a false one: 0.01 + 4 = 4.01.
        let parts = of(&[0.1, -1.9], &[0.0, 2.0], 2.0);
        assert!((parts.localisation_m2 - 0.01).abs() < 1e-12);
        assert_eq!((parts.missed_m2, parts.false_m2), (2.0, 2.0));
    }

    #[test]
    fn without_estimates_the_distance_is_that_of_all_misses() {
        assert_eq!(of(&[], &[], 2.0).distance_m(), 0.0);
        assert_eq!(of(&[], &[1.0, 2.0], 2.0).distance_m(), 2.0);
        assert_eq!(of(&[1.0, 9.0], &[], 2.0).distance_m(), 2.0);
    }

    #[test]
    fn gospa_is_symmetric_if_misses_and_false_objects_are_exchanged() {
        let (a, b) = ([0.0, 1.3, 7.0, 7.9], [0.4, 2.0, 8.0]);
        let (there, back) = (of(&a, &b, 2.0), of(&b, &a, 2.0));
        assert!((there.distance_m() - back.distance_m()).abs() < 1e-12);
        assert_eq!((there.missed_m2, there.false_m2), (back.false_m2, back.missed_m2));
    }

    #[test]
    fn of_three_estimates_of_two_objects_the_two_nearest_are_matched() {
        let parts = of(
            &[6.608904066688976, 3.992363730804965, 6.185228584444234],
            &[4.483020948735263, 3.497087404884948],
            2.857578888183412,
        );
        assert!((parts.localisation_m2 - 3.142_809_474_082_757).abs() < 1e-12, "{parts:?}");
    }

    /// By the definition: the least over all assignments.
    fn least_by_enumeration(predictions: &[f64], truth: &mut Vec<Option<f64>>, cutoff_m: f64) -> f64 {
        let penalty = cutoff_m * cutoff_m / 2.0;
        let Some((first, rest)) = predictions.split_first() else {
            return truth.iter().flatten().map(|_| penalty).sum();
        };
        let mut least = penalty + least_by_enumeration(rest, truth, cutoff_m);
        for place in 0..truth.len() {
            let Some(object) = truth[place].take() else { continue };
            let distance = (first - object).abs().min(cutoff_m);
            least = least.min(distance * distance + least_by_enumeration(rest, truth, cutoff_m));
            truth[place] = Some(object);
        }
        least
    }

    proptest! {
        #[test]
        fn gospa_is_the_minimum_over_all_assignments(
            predictions in prop::collection::vec(0.0..8.0f64, 0..5),
            truth in prop::collection::vec(0.0..8.0f64, 0..5),
            cutoff_m in 0.5..4.0f64,
        ) {
            let parts = of(&predictions, &truth, cutoff_m);
            let mut objects: Vec<_> = truth.iter().copied().map(Some).collect();
            let least = least_by_enumeration(&predictions, &mut objects, cutoff_m);
            prop_assert!((parts.distance_m() - libm::sqrt(least)).abs() < 1e-9);
        }
    }
}
