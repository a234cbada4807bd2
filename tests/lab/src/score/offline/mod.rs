//! The score of fused objects against a table of true objects.

mod headings;
mod tracks;

pub(crate) use headings::HeadingScore;

use crate::data::scene::TrueBox;
use crate::data::truth_table::Truth;
use crate::score::continuity::TrackContinuity;
use crate::score::estimate::Estimate;
use crate::score::frame_metrics::{Metrics, Tally, frame_metrics};
use crate::score::matching::{Frame, MatchingRule, Outcome, PositionRule};
use crate::score::moments::Moments;
use crate::score::offline::headings::Headings;
use crate::score::offline::tracks::Tracks;
use crate::score::tracking::figures::TrackingFigures;
use crate::score::tracking::sequence::ratio;
use serde::Serialize;
use v2x_common::fused::FusedObject;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::association::assignment::Assigner;

/// Match radius between objects of compatible classes, m. Also the cut-off of GOSPA.
pub(crate) const MATCH_RADIUS_M: f64 = 2.0;
const RULE: PositionRule = PositionRule { radius_m: Some(MATCH_RADIUS_M), is_class_aware: true };

/// The score: means over ticks, but for F1, headings and the tracking metrics, which are over all boxes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct TruthScore {
    /// Errors, precision, recall and GOSPA.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// The harmonic mean of precision and recall over all boxes: 2 TP / (2 TP + FP + FN).
    pub f1: Option<f64>,
    /// Errors of headings.
    #[serde(flatten)]
    pub headings: HeadingScore,
    /// HOTA, MOTA, IDF1 and AMOTA. Classes count for AMOTA only. Null where a method reports a track twice at one time.
    #[serde(flatten)]
    pub tracking: TrackingFigures,
    /// Mean length of the error of the matched objects' velocities, m/s.
    pub velocity_error_mps: Option<f64>,
    /// How often the track of a true object changed.
    pub id_switches: u64,
    /// Track ids for each matched object.
    pub ids_per_object: Option<f64>,
    /// The match radius, m.
    pub match_radius_m: f64,
    /// Rows of the truth with an unknown class name.
    pub unknown_classes: u64,
}

/// Scores tick after tick.
#[derive(Debug)]
pub(crate) struct TruthScorer {
    truth: Truth,
    tally: Tally,
    velocity: Moments,
    headings: Headings,
    tracks: Tracks,
    continuity: TrackContinuity,
    assigner: Assigner,
}

impl TruthScorer {
    /// Scores against this truth.
    pub(crate) fn new(truth: Truth) -> Self {
        Self {
            truth,
            tally: Tally::default(),
            velocity: Moments::default(),
            headings: Headings::default(),
            tracks: Tracks::default(),
            continuity: TrackContinuity::default(),
            assigner: Assigner::default(),
        }
    }

    /// The time for which the truth is known.
    pub(crate) fn span(&self) -> (Timestamp, Timestamp) {
        self.truth.span()
    }

    /// Adds the objects of one time. Times must not decrease. Outside of the truth's own span nothing is scored.
    pub(crate) fn add(&mut self, at: Timestamp, objects: &[FusedObject]) {
        let (begin, end) = self.span();
        if at < begin || at > end {
            return;
        }
        let there = self.truth.at(at);
        let estimates: Vec<_> = objects.iter().map(Estimate::from).collect();
        let truth: Vec<_> = there.objects.iter().map(TrueBox::from).collect();
        let frame = Frame { estimates: &estimates, truth: &truth, counts: &vec![true; truth.len()] };
        let matching = frame.matched(MatchingRule::ByPosition(RULE), &mut self.assigner);
        self.tally.add(&frame_metrics(&frame, &matching, MATCH_RADIUS_M, &mut self.assigner));
        self.continuity.add(objects, &truth, &matching);
        let mut velocity = Moments::default();
        for (fused, outcome) in objects.iter().zip(&matching.outcomes) {
            let Outcome::Matched(place) = *outcome else { continue };
            let error = |(x, y)| libm::hypot(fused.velocity.0 - x, fused.velocity.1 - y);
            velocity.add(there.velocities[place].map(error));
            self.headings.add(&fused.bev, &truth[place].bev, there.velocities[place]);
        }
        self.tracks.add(objects, truth);
        self.velocity.add(velocity.mean());
    }

    /// The means so far.
    pub(crate) fn score(&self) -> TruthScore {
        let (tracks, metrics) = (self.continuity.summary(), self.tally.metrics());
        let found = 2 * metrics.true_positives;
        TruthScore {
            metrics,
            f1: ratio(found, found + metrics.false_positives + metrics.false_negatives),
            headings: self.headings.score(),
            tracking: self.tracks.figures(),
            velocity_error_mps: self.velocity.mean(),
            id_switches: tracks.id_switches,
            ids_per_object: tracks.ids_per_object,
            match_radius_m: MATCH_RADIUS_M,
            unknown_classes: self.truth.unknown_classes(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::fixture::{at_ms, predicted};
    use std::path::Path;
    use v2x_common::class::Class;
    use v2x_common::geometry::BevBox;
    use v2x_common::id::TrackId;

    const TRUTH: &str = "t,object_id,class,x,y,vx,vy,w,d,yaw\n\
        0,a,car,0,0,3,4,2,4,0\n0,b,pedestrian,20,0,nan,nan,2,4,0\n\
        1,a,car,0,0,3,4,2,4,0\n1,b,pedestrian,20,0,nan,nan,2,4,0\n";

    fn scorer() -> TruthScorer {
        TruthScorer::new(Truth::read(TRUTH.as_bytes(), Path::new("truth.csv")).unwrap())
    }

    fn fused(track: u64, class: Class, bev: BevBox) -> FusedObject {
        FusedObject::from_box(TrackId(track), class, bev)
    }

    #[test]
    fn errors_of_matched_objects_are_averaged_and_the_others_counted() {
        let mut scorer = scorer();
        let turned = BevBox { d: 5.0, yaw: 0.5, ..predicted(1.0, 0.0) };
        scorer.add(at_ms(500), &[fused(1, Class::Car, turned), fused(2, Class::Car, predicted(20.0, 0.0))]);
        let TruthScore { metrics, velocity_error_mps, .. } = scorer.score();
        // A car is no pedestrian: a false one and a miss.
        assert_eq!((metrics.true_positives, metrics.false_positives, metrics.false_negatives), (1, 1, 1));
        assert_eq!((metrics.ate_m, metrics.ade_m, metrics.precision), (Some(1.0), Some(1.0), Some(0.5)));
        assert!((metrics.aoe_deg.unwrap() - 0.5_f64.to_degrees()).abs() < 1e-12);
        assert_eq!(velocity_error_mps, Some(5.0));
        // GOSPA ignores the class.
        assert_eq!(metrics.gospa_m, Some(1.0));
    }

    #[test]
    fn an_unknown_class_matches_any_class_within_two_metres() {
        let mut scorer = scorer();
        let objects = [(1, 18.1), (2, 2.1)].map(|(id, x)| fused(id, Class::Unknown, predicted(x, 0.0)));
        scorer.add(at_ms(0), &objects);
        let metrics = scorer.score().metrics;
        assert_eq!((metrics.true_positives, metrics.false_positives, metrics.false_negatives), (1, 1, 1));
    }

    #[test]
    fn another_track_of_the_same_object_is_a_switch() {
        let mut scorer = scorer();
        for (ms, track) in [(0, 7), (100, 7), (200, 8), (300, 7)] {
            scorer.add(at_ms(ms), &[fused(track, Class::Car, predicted(0.0, 0.0))]);
        }
        assert_eq!((scorer.score().id_switches, scorer.score().ids_per_object), (2, Some(2.0)));
    }

    #[test]
    fn f1_and_mota_are_over_all_boxes_and_not_means_over_ticks() {
        let mut scorer = scorer();
        // One of two objects is found; then both, and two false ones: 3 right, 2 false, 1 missed.
        scorer.add(at_ms(0), &[fused(1, Class::Car, predicted(0.0, 0.0))]);
        let all =
            [(1, Class::Car, 0.0), (2, Class::Adult, 20.0), (3, Class::Car, 50.0), (4, Class::Car, 60.0)];
        scorer.add(at_ms(100), &all.map(|(id, class, x)| fused(id, class, predicted(x, 0.0))));
        let score = scorer.score();
        assert_eq!((score.f1, score.tracking.mota), (Some(6.0 / 9.0), Some(1.0 - 3.0 / 4.0)));
        assert_eq!(score.tracking.idf1, Some(6.0 / 9.0));
    }

    #[test]
    fn outside_the_time_span_of_the_truth_no_estimate_is_scored() {
        let mut scorer = scorer();
        for ms in [-2, 1002] {
            scorer.add(at_ms(ms), &[fused(1, Class::Car, predicted(0.0, 0.0))]);
        }
        assert_eq!(scorer.score().metrics.frames, 0);
    }
}
