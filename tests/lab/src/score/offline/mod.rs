//! The score of fused objects against a table of true objects.

mod headings;
mod region;
mod tracks;

pub(crate) use headings::HeadingScore;
pub(crate) use region::Region;

use crate::data::scene::TrueBox;
use crate::data::truth_table::Truth;
use crate::score::continuity::TrackContinuity;
use crate::score::detection::DetectionScore;
use crate::score::estimate::Estimate;
use crate::score::frame_metrics::{Metrics, Tally, frame_metrics};
use crate::score::matching::{Frame, MatchingRule, Outcome, PositionRule};
use crate::score::moments::Moments;
use crate::score::offline::headings::Headings;
use crate::score::offline::tracks::Tracks;
use crate::score::tracking::figures::TrackingFigures;
use crate::score::tracking::sequence::ratio;
use serde::Serialize;
use std::collections::BTreeMap;
use v2x_common::fused::FusedObject;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::AgentId;
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
    /// Average precisions and nuScenes' errors.
    #[serde(flatten)]
    pub detection: DetectionScore,
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
    /// Where the truth is complete; `None` where it is so everywhere.
    region: Option<Region>,
    /// The newest place of each sensor, m.
    sensors: BTreeMap<AgentId, [f64; 2]>,
    tally: Tally,
    velocity: Moments,
    headings: Headings,
    tracks: Tracks,
    continuity: TrackContinuity,
    assigner: Assigner,
}

impl TruthScorer {
    /// Scores against this truth, which is complete in the region, or everywhere.
    pub(crate) fn new(truth: Truth, region: Option<Region>) -> Self {
        Self {
            truth,
            region,
            sensors: BTreeMap::new(),
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

    /// Notes where a sensor is from now on.
    pub(crate) fn note_sensor(&mut self, sensor: AgentId, pose: Pose) {
        self.sensors.insert(sensor, [pose.x, pose.y]);
    }

    fn counts(&self, bev: &BevBox) -> bool {
        self.region.is_none_or(|region| region.contains([bev.x, bev.y], self.sensors.values().copied()))
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
        let counts: Vec<_> = truth.iter().map(|object| self.counts(&object.bev)).collect();
        let frame = Frame { estimates: &estimates, truth: &truth, counts: &counts };
        let matching = frame.matched(MatchingRule::ByPosition(RULE), &mut self.assigner);
        let matching = matching.restricted_to(|_| true, |index| self.counts(&estimates[index].bev));
        self.tally.add(&frame_metrics(&frame, &matching, MATCH_RADIUS_M, &mut self.assigner));
        self.continuity.add(objects, &truth, &matching);
        let mut velocity = Moments::default();
        for (fused, outcome) in objects.iter().zip(&matching.outcomes) {
            let Outcome::Matched(place) = *outcome else { continue };
            let error = |(x, y)| libm::hypot(fused.velocity.0 - x, fused.velocity.1 - y);
            velocity.add(there.velocities[place].map(error));
            self.headings.add(&fused.bev, &truth[place].bev, there.speeds[place]);
        }
        self.velocity.add(velocity.mean());
        let known = there.velocities.iter().map(|velocity| velocity.map(|(x, y)| [x, y]));
        let true_ones =
            truth.into_iter().zip(known).zip(counts).filter_map(|(one, counts)| counts.then_some(one));
        let reported = objects.iter().zip(&matching.outcomes);
        let reported =
            reported.filter(|(_, outcome)| **outcome != Outcome::Ignored).map(|(object, _)| object);
        self.tracks.add(true_ones, reported);
    }

    /// The means so far.
    pub(crate) fn score(&self) -> TruthScore {
        let (tracks, metrics) = (self.continuity.summary(), self.tally.metrics());
        let (tracking, detection) = self.tracks.figures();
        let found = 2 * metrics.true_positives;
        TruthScore {
            metrics,
            f1: ratio(found, found + metrics.false_positives + metrics.false_negatives),
            headings: self.headings.score(),
            tracking,
            detection,
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
        scorer_within(None)
    }

    fn scorer_within(region: Option<Region>) -> TruthScorer {
        TruthScorer::new(Truth::read(TRUTH.as_bytes(), Path::new("truth.csv")).unwrap(), region)
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

    /// The average precision of a right box before a false one: by the devkit's interpolation the precision is 1 at every
    /// recall but the last, where it is a half.
    const ALMOST_1: f64 = (89.0 * 0.9 + 0.4) / 90.0 / 0.9;

    #[test]
    fn outside_of_the_region_nothing_counts() {
        // The pedestrian at 20 m is outside, the car at 0 m is in.
        let rectangle = Region::Rectangle { min: [-5.0, -5.0], max: [5.0, 5.0] };
        for region in [rectangle, Region::AroundSensors { radius_m: 6.0 }] {
            let mut scorer = scorer_within(Some(region));
            scorer.note_sensor(AgentId::new("a").unwrap(), Pose { x: 0.0, y: 1.0, yaw: 0.0 });
            // The car; a false one; one of the pedestrian and one of nothing, both outside.
            let xs = [(1, 0.1), (2, 4.0), (3, 20.1), (4, 50.0)];
            let existence = |id: u64| 1.0 / id as f64;
            let object = |(id, x)| FusedObject {
                existence: existence(id),
                ..fused(id, Class::Car, predicted(x, 0.0))
            };
            scorer.add(at_ms(0), &xs.map(object));
            let score = scorer.score();
            let metrics = score.metrics;
            assert_eq!((metrics.true_positives, metrics.false_positives, metrics.false_negatives), (1, 1, 0));
            assert_eq!((score.f1, score.tracking.mota), (Some(2.0 / 3.0), Some(0.0)));
            let map = score.detection.map.unwrap();
            assert!((map - ALMOST_1).abs() < 1e-9, "{map}");
        }
    }

    #[test]
    fn precision_by_score_is_average_precision() {
        let mut scorer = scorer();
        let sure = FusedObject { existence: 0.9, ..fused(1, Class::Car, predicted(0.1, 0.0)) };
        let ghost = FusedObject { existence: 0.5, ..fused(2, Class::Car, predicted(9.0, 0.0)) };
        scorer.add(at_ms(0), &[ghost, sure]);
        let detection = scorer.score().detection;
        // Of two classes, one is found.
        let map = detection.map.unwrap();
        assert!((map - ALMOST_1 / 2.0).abs() < 1e-9, "{map}");
        assert_eq!(detection.ap_iou, Some([0.5; 3]));
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
