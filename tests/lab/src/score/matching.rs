//! The first step of every score: matching of estimates and true objects.
//!
//! Fused objects of a run are matched by position: the most pairs within reach and, among those, the least total
//! distance. The class is no condition there: a car reported as a truck at the right position is a classification error,
//! not a miss plus a false object. Objects that count come first. An unmatched estimate near an object that does not
//! count is ignored (as in KITTI's "don't care" regions).
//!
//! Where the measurements in an estimate are known, it is matched by their provenance, at any distance: no error is cut
//! off.

use crate::data::scene::TrueBox;
use crate::score::errors::distance_m;
use crate::score::estimate::Estimate;
use v2x_common::geometry::BevBox;
use v2x_fusion_hub::association::assignment::{Assigner, Candidate};

/// The outcome of one estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It is matched to the object at this place of the truth.
    Matched(usize),
    /// It is of the object at this place, to which another estimate is matched: a false positive whose error counts.
    Repeated(usize),
    /// It is of no object.
    False,
    /// It is not counted, since its object does not count.
    Ignored,
}

/// The pairs of one frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Matching {
    /// By estimate.
    pub outcomes: Vec<Outcome>,
    /// Places in the truth of the objects that count and that have no estimate.
    pub missed: Vec<usize>,
}

/// One frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<'a> {
    /// The estimates.
    pub estimates: &'a [Estimate],
    /// The true objects.
    pub truth: &'a [TrueBox],
    /// For each true object whether it counts.
    pub counts: &'a [bool],
}

/// How estimates and true objects are matched.
#[derive(Clone, Copy, Debug)]
pub(crate) enum MatchingRule<'a> {
    /// By position: the most pairs and, among those, the least total distance.
    ByPosition(PositionRule),
    /// By the provenance of the measurements in an estimate.
    ByProvenance {
        /// Each estimate's place in the truth; `None` for clutter.
        places: &'a [Option<usize>],
        /// How several estimates of one object are counted.
        repeats: Repeats,
    },
}

/// Which pairs are possible in matching by position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PositionRule {
    /// Greatest distance of a pair, m; `None` for any distance.
    pub radius_m: Option<f64>,
    /// Whether classes must be compatible.
    pub is_class_aware: bool,
}

/// How several estimates of one object are counted in matching by provenance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Repeats {
    /// The closest is matched, the others are false. For the raw detections of a run.
    ClosestIsMatched,
    /// The first is matched, the errors of the others add up. For the paper's tables and for sweeps.
    ErrorsAddUp,
}

impl Frame<'_> {
    /// Matches by a rule.
    pub(crate) fn matched(&self, rule: MatchingRule<'_>, assigner: &mut Assigner) -> Matching {
        let outcomes = match rule {
            MatchingRule::ByPosition(rule) => self.by_position(rule, assigner),
            MatchingRule::ByProvenance { places, repeats } => self.by_provenance(places, repeats),
        };
        let mut is_missed = self.counts.to_vec();
        for outcome in &outcomes {
            if let Outcome::Matched(place) = outcome {
                is_missed[*place] = false;
            }
        }
        let missed = (0..is_missed.len()).filter(|place| is_missed[*place]).collect();
        Matching { outcomes, missed }
    }

    fn by_position(&self, rule: PositionRule, assigner: &mut Assigner) -> Vec<Outcome> {
        let candidates = self.candidates(rule);
        let reach_m = rule
            .radius_m
            .unwrap_or_else(|| candidates.iter().map(|candidate| candidate.cost).fold(1.0, f64::max));
        // One estimate without a pair costs more than any other pairs can save: most pairs come first.
        #[expect(clippy::cast_precision_loss, reason = "counts of objects")]
        let unmatched_cost = reach_m * (self.estimates.len() + 1) as f64;
        let columns = assigner.solve(self.estimates.len(), self.truth.len(), &candidates, unmatched_cost);
        let outcome = |(estimate, column): (&Estimate, &Option<u32>)| match column {
            Some(place) => Outcome::Matched(*place as usize),
            None if self.is_near_uncounted(&estimate.bev, reach_m) => Outcome::Ignored,
            None => Outcome::False,
        };
        self.estimates.iter().zip(columns).map(outcome).collect()
    }

    fn is_near_uncounted(&self, bev: &BevBox, radius_m: f64) -> bool {
        let uncounted = self.truth.iter().zip(self.counts).filter(|(_, counts)| !**counts);
        uncounted.into_iter().any(|(object, _)| distance_m(bev, &object.bev) <= radius_m)
    }

    fn candidates(&self, rule: PositionRule) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        for (row, estimate) in (0u32..).zip(self.estimates) {
            for (col, (object, counts)) in (0u32..).zip(self.truth.iter().zip(self.counts)) {
                let is_possible =
                    *counts && (!rule.is_class_aware || estimate.class.is_compatible_with(object.class));
                if !is_possible {
                    continue;
                }
                let cost = distance_m(&estimate.bev, &object.bev);
                if rule.radius_m.is_none_or(|radius_m| cost <= radius_m) {
                    candidates.push(Candidate { row, col, cost });
                }
            }
        }
        candidates
    }

    fn by_provenance(&self, places: &[Option<usize>], repeats: Repeats) -> Vec<Outcome> {
        let chosen = match repeats {
            Repeats::ClosestIsMatched => self.closest(places),
            Repeats::ErrorsAddUp => self.first(places),
        };
        let outcome = |(index, place): (usize, &Option<usize>)| match *place {
            None => Outcome::False,
            Some(place) if !self.counts[place] => Outcome::Ignored,
            Some(place) if chosen[place] == Some(index) => Outcome::Matched(place),
            Some(place) => match repeats {
                Repeats::ClosestIsMatched => Outcome::False,
                Repeats::ErrorsAddUp => Outcome::Repeated(place),
            },
        };
        places.iter().enumerate().map(outcome).collect()
    }

    /// For each true object the first estimate of it.
    fn first(&self, places: &[Option<usize>]) -> Vec<Option<usize>> {
        let mut first = vec![None; self.truth.len()];
        for (index, place) in places.iter().enumerate().filter_map(|(index, place)| Some((index, (*place)?)))
        {
            first[place] = first[place].or(Some(index));
        }
        first
    }

    /// For each true object the closest estimate of it.
    fn closest(&self, places: &[Option<usize>]) -> Vec<Option<usize>> {
        let mut closest: Vec<Option<(f64, usize)>> = vec![None; self.truth.len()];
        for (index, (estimate, place)) in self.estimates.iter().zip(places).enumerate() {
            let Some(place) = *place else { continue };
            let distance = distance_m(&estimate.bev, &self.truth[place].bev);
            if closest[place].is_none_or(|(least, _)| distance < least) {
                closest[place] = Some((distance, index));
            }
        }
        closest.into_iter().map(|best| best.map(|(_, index)| index)).collect()
    }
}

impl Outcome {
    /// The place of its object in the truth.
    pub(crate) const fn place(self) -> Option<usize> {
        match self {
            Self::Matched(place) | Self::Repeated(place) => Some(place),
            Self::False | Self::Ignored => None,
        }
    }
}

impl Matching {
    /// The same pairs for fewer objects: those for which `keep_object` holds, and the false estimates for which `keep_false`
    /// holds. Everything else is ignored.
    #[must_use]
    pub(crate) fn restricted_to(
        &self,
        keep_object: impl Fn(usize) -> bool,
        keep_false: impl Fn(usize) -> bool,
    ) -> Self {
        let kept = |(index, outcome): (usize, &Outcome)| match *outcome {
            Outcome::Matched(place) | Outcome::Repeated(place) if !keep_object(place) => Outcome::Ignored,
            Outcome::False if !keep_false(index) => Outcome::Ignored,
            outcome => outcome,
        };
        Self {
            outcomes: self.outcomes.iter().enumerate().map(kept).collect(),
            missed: self.missed.iter().copied().filter(|place| keep_object(*place)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Outcome::{False, Ignored, Matched, Repeated};
    use super::*;
    use crate::data::fixture::parked;
    use crate::score::fixture::estimate;
    use v2x_common::class::Class;

    const WITHIN_2_M: PositionRule = PositionRule { radius_m: Some(2.0), is_class_aware: false };

    fn by_position(estimates: &[Estimate], truth: &[TrueBox], counts: &[bool]) -> Matching {
        let frame = Frame { estimates, truth, counts };
        frame.matched(MatchingRule::ByPosition(WITHIN_2_M), &mut Assigner::default())
    }

    fn by_distance(estimates: &[f64], truth: &[f64], counts: &[bool]) -> Matching {
        let estimates: Vec<_> = estimates.iter().map(|x| estimate(*x, 0.0)).collect();
        let truth: Vec<_> = (0..).zip(truth).map(|(id, x)| TrueBox::from(&parked(id, *x, 0.0))).collect();
        by_position(&estimates, &truth, counts)
    }

    #[test]
    fn more_pairs_win_over_a_shorter_total_distance() {
        // A greedy matching would match the first estimate to the object at 0, and the second to none.
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
    fn an_estimate_of_an_uncounted_object_is_ignored() {
        let matching = by_distance(&[0.1, 0.3, 9.0], &[0.0], &[false]);
        assert_eq!(matching, Matching { outcomes: vec![Ignored, Ignored, False], missed: vec![] });
    }

    #[test]
    fn objects_that_count_are_preferred_over_nearer_ones_that_do_not() {
        assert_eq!(by_distance(&[0.5], &[0.4, 1.5], &[false, true]).outcomes, [Matched(1)]);
    }

    #[test]
    fn the_class_is_a_condition_only_where_the_rule_says_so() {
        let truth = [TrueBox { class: Class::Truck, ..TrueBox::from(&parked(0, 0.0, 0.0)) }];
        let estimates = [estimate(0.0, 0.0)];
        assert_eq!(by_position(&estimates, &truth, &[true]).outcomes, [Matched(0)]);
        let frame = Frame { estimates: &estimates, truth: &truth, counts: &[true] };
        let rule = PositionRule { is_class_aware: true, ..WITHIN_2_M };
        let matching = frame.matched(MatchingRule::ByPosition(rule), &mut Assigner::default());
        assert_eq!(matching, Matching { outcomes: vec![False], missed: vec![0] });
    }

    #[test]
    fn without_a_radius_every_distance_is_possible() {
        let truth = [parked(0, 0.0, 0.0), parked(1, 10.0, 0.0)].map(|object| TrueBox::from(&object));
        let estimates = [estimate(900.0, 0.0), estimate(9.0, 0.0)];
        let frame = Frame { estimates: &estimates, truth: &truth, counts: &[true; 2] };
        let rule = PositionRule { radius_m: None, is_class_aware: true };
        let matching = frame.matched(MatchingRule::ByPosition(rule), &mut Assigner::default());
        assert_eq!(matching.outcomes, [Matched(1), Matched(0)]);
    }

    #[test]
    fn provenance_matches_at_any_distance_and_the_rule_says_which_of_two_is_matched() {
        let estimates = [30.0, 4.0, 3.0, 50.0].map(|x| estimate(x, 0.0));
        let truth = [0.0, 2.0, 50.0, 9.0];
        let truth: Vec<_> = (0..).zip(truth).map(|(id, x)| TrueBox::from(&parked(id, x, 0.0))).collect();
        let counts = [true, true, false, true];
        let frame = Frame { estimates: &estimates, truth: &truth, counts: &counts };
        let matched = |places: &[Option<usize>], repeats| {
            let rule = MatchingRule::ByProvenance { places, repeats };
            frame.matched(rule, &mut Assigner::default())
        };
        let places = [Some(1), Some(0), Some(0), None];
        let closest = matched(&places, Repeats::ClosestIsMatched);
        assert_eq!(closest.outcomes, [Matched(1), False, Matched(0), False]);
        assert_eq!(closest.missed, [3]);
        let first = matched(&places, Repeats::ErrorsAddUp);
        assert_eq!(first.outcomes, [Matched(1), Matched(0), Repeated(0), False]);
        let uncounted = [Some(2), None, None, None];
        assert_eq!(matched(&uncounted, Repeats::ErrorsAddUp).outcomes[0], Ignored);
    }

    #[test]
    fn estimates_outside_a_restriction_are_ignored() {
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
