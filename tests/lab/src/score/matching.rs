//! Which prediction is of which true object.
//!
//! Fused objects are matched by distance alone: the most pairs within the radius and, among those, the
//! least total distance. The class is no condition: a car reported as a truck at the right place is a
//! classification error, and as a miss plus a false object it would hide in the wrong figure. Objects
//! that count come first; a prediction left over near a real object that does not count is neither
//! right nor wrong (as in KITTI's "don't care" regions).
//!
//! Raw detections are matched by the simulation's identity, at any distance: no error is cut off.

use v2x_agent::truth::TrueObject;
use v2x_common::geometry::BevBox;
use v2x_fusion_hub::assignment::{Assigner, Candidate};

/// What became of one prediction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It is of the object at this place of the truth.
    Matched(usize),
    /// There is no such object.
    False,
    /// It is of a real object that does not count.
    Ignored,
}

/// The pairs of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matching {
    /// By prediction.
    pub outcomes: Vec<Outcome>,
    /// Places in the truth of the objects that count and that nobody predicted.
    pub missed: Vec<usize>,
}

/// Matches by least total distance among the largest sets of pairs within `radius_m`; `counts` says of
/// each true object whether it counts.
pub fn match_by_distance(
    predictions: &[BevBox],
    truth: &[TrueObject],
    counts: &[bool],
    radius_m: f64,
    assigner: &mut Assigner,
) -> Matching {
    let candidates = pairs_within(predictions, truth, counts, radius_m);
    // A prediction left alone costs more than any detour of the others: most pairs first.
    #[expect(clippy::cast_precision_loss, reason = "counts of objects")]
    let unmatched_cost = radius_m * (predictions.len() + 1) as f64;
    let columns = assigner.solve(predictions.len(), truth.len(), &candidates, unmatched_cost);
    let near_uncounted = |bev: &BevBox| {
        truth.iter().zip(counts).any(|(object, counts)| !counts && distance_m(bev, &object.bev) <= radius_m)
    };
    let outcomes = predictions
        .iter()
        .zip(columns)
        .map(|(bev, column)| match column {
            Some(place) => Outcome::Matched(*place as usize),
            None if near_uncounted(bev) => Outcome::Ignored,
            None => Outcome::False,
        })
        .collect();
    with_missed(outcomes, counts)
}

/// Matches by identity: `places` has each prediction's place in the truth, `None` for clutter. Of
/// several predictions of one object the closest is the match and the others are false.
pub fn match_by_identity(
    predictions: &[BevBox],
    places: &[Option<usize>],
    truth: &[TrueObject],
    counts: &[bool],
) -> Matching {
    let mut closest: Vec<Option<(f64, usize)>> = vec![None; truth.len()];
    for (index, (bev, place)) in predictions.iter().zip(places).enumerate() {
        let Some(place) = *place else { continue };
        let distance = distance_m(bev, &truth[place].bev);
        if closest[place].is_none_or(|(least, _)| distance < least) {
            closest[place] = Some((distance, index));
        }
    }
    let outcomes = places
        .iter()
        .enumerate()
        .map(|(index, place)| match *place {
            Some(place) if !counts[place] => Outcome::Ignored,
            Some(place) if closest[place].is_some_and(|(_, best)| best == index) => Outcome::Matched(place),
            _ => Outcome::False,
        })
        .collect();
    with_missed(outcomes, counts)
}

impl Matching {
    /// The same pairs seen on fewer objects: those for which `keep_object` holds, and the false
    /// predictions for which `keep_false` holds. Everything else counts neither way.
    pub fn restricted_to(
        &self,
        keep_object: impl Fn(usize) -> bool,
        keep_false: impl Fn(usize) -> bool,
    ) -> Self {
        let kept = |(index, outcome): (usize, &Outcome)| match *outcome {
            Outcome::Matched(place) if !keep_object(place) => Outcome::Ignored,
            Outcome::False if !keep_false(index) => Outcome::Ignored,
            outcome => outcome,
        };
        Self {
            outcomes: self.outcomes.iter().enumerate().map(kept).collect(),
            missed: self.missed.iter().copied().filter(|place| keep_object(*place)).collect(),
        }
    }
}

/// Distance between two boxes' centres, m.
pub fn distance_m(a: &BevBox, b: &BevBox) -> f64 {
    a.pose().distance_to(b.x, b.y)
}

fn pairs_within(
    predictions: &[BevBox],
    truth: &[TrueObject],
    counts: &[bool],
    radius_m: f64,
) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    for (row, bev) in (0u32..).zip(predictions) {
        for (col, (object, _)) in (0u32..).zip(truth.iter().zip(counts)).filter(|(_, (_, counts))| **counts) {
            let cost = distance_m(bev, &object.bev);
            if cost <= radius_m {
                candidates.push(Candidate { row, col, cost });
            }
        }
    }
    candidates
}

fn with_missed(outcomes: Vec<Outcome>, counts: &[bool]) -> Matching {
    let mut missing = counts.to_vec();
    for outcome in &outcomes {
        if let Outcome::Matched(place) = outcome {
            missing[*place] = false;
        }
    }
    let missed = (0..missing.len()).filter(|place| missing[*place]).collect();
    Matching { outcomes, missed }
}

#[cfg(test)]
mod tests {
    use super::Outcome::False;
    use super::Outcome::Ignored;
    use super::Outcome::Matched;
    use super::*;
    use crate::data::fixture::{parked, predicted};

    fn by_distance(predictions: &[f64], truth: &[f64], counts: &[bool]) -> Matching {
        let predictions: Vec<_> = predictions.iter().map(|x| predicted(*x, 0.0)).collect();
        let truth: Vec<_> = (0..).zip(truth).map(|(id, x)| parked(id, *x, 0.0)).collect();
        match_by_distance(&predictions, &truth, counts, 2.0, &mut Assigner::default())
    }

    #[test]
    fn more_pairs_win_over_a_shorter_total_distance() {
        // Greedy would give the first prediction to the object at 0 and leave the second alone.
        let matching = by_distance(&[0.1, -1.9], &[0.0, 2.0], &[true, true]);
        assert_eq!(matching, Matching { outcomes: vec![Matched(1), Matched(0)], missed: vec![] });
    }

    #[test]
    fn among_equally_many_pairs_the_total_distance_is_least() {
        let matching = by_distance(&[1.0, 0.2], &[0.0, 1.5], &[true, true]);
        assert_eq!(matching.outcomes, [Matched(1), Matched(0)]);
    }

    #[test]
    fn beyond_the_radius_there_is_a_false_prediction_and_a_miss() {
        let matching = by_distance(&[2.1], &[0.0], &[true]);
        assert_eq!(matching, Matching { outcomes: vec![False], missed: vec![0] });
        assert_eq!(by_distance(&[2.0], &[0.0], &[true]).outcomes, [Matched(0)]);
    }

    #[test]
    fn a_prediction_of_an_uncounted_object_counts_neither_way() {
        let matching = by_distance(&[0.1, 0.3, 9.0], &[0.0], &[false]);
        assert_eq!(matching, Matching { outcomes: vec![Ignored, Ignored, False], missed: vec![] });
    }

    #[test]
    fn objects_that_count_are_preferred_over_nearer_ones_that_do_not() {
        assert_eq!(by_distance(&[0.5], &[0.4, 1.5], &[false, true]).outcomes, [Matched(1)]);
    }

    #[test]
    fn the_class_is_no_condition() {
        let truth = [TrueObject { class: v2x_common::class::Class::Truck, ..parked(0, 0.0, 0.0) }];
        let matching =
            match_by_distance(&[predicted(0.0, 0.0)], &truth, &[true], 2.0, &mut Assigner::default());
        assert_eq!(matching.outcomes, [Matched(0)]);
    }

    #[test]
    fn identity_matches_at_any_distance_and_the_closest_of_two_is_right() {
        let predictions =
            [predicted(30.0, 0.0), predicted(3.0, 0.0), predicted(4.0, 0.0), predicted(50.0, 0.0)];
        let truth = [parked(0, 0.0, 0.0), parked(1, 2.0, 0.0), parked(2, 50.0, 0.0), parked(3, 9.0, 0.0)];
        let places = [Some(1), Some(0), Some(0), None];
        let matching = match_by_identity(&predictions, &places, &truth, &[true, true, false, true]);
        assert_eq!(matching.outcomes, [Matched(1), Matched(0), False, False]);
        assert_eq!(matching.missed, [3]);
        let ignored = match_by_identity(&predictions[..1], &[Some(2)], &truth, &[true, true, false, true]);
        assert_eq!(ignored.outcomes, [Ignored]);
    }

    #[test]
    fn a_restriction_turns_everything_else_into_neither() {
        let matching = by_distance(&[0.0, 5.0, 20.0, 40.0], &[0.0, 5.0, 9.0, 12.0], &[true; 4]);
        let common = matching.restricted_to(|place| place % 2 == 1, |index| index == 3);
        assert_eq!(common, Matching { outcomes: vec![Ignored, Matched(1), Ignored, False], missed: vec![3] });
    }

    #[test]
    fn empty_frames_match_nothing() {
        assert_eq!(by_distance(&[], &[1.0], &[true]), Matching { outcomes: vec![], missed: vec![0] });
        assert_eq!(by_distance(&[1.0], &[], &[]), Matching { outcomes: vec![False], missed: vec![] });
    }
}
