//! What a frame shows of its sensor by itself: so it is read until something is learnt of its agent, which takes a second and
//! more. It is a function of the frame alone, and the order of arrival does not matter.

use super::reading::LearntSensor;
use super::score_counts::ScoreCounts;
use super::sensor_statistics::SensorStatistics;
use crate::values::{ScoreModel, SeenPlaces, SensorAxes};
use v2x_common::detection::DetectionFrame;

impl LearntSensor {
    /// With what the frame itself shows of scores and view where nothing is learnt of them.
    #[must_use]
    pub(super) fn or_shown_by(mut self, frame: &DetectionFrame) -> Self {
        if self.scores == ScoreModel::Ignored {
            self.scores = scores_of(frame);
        }
        if self.view_m.is_none() {
            self.view_m = view_m_of(frame);
            self.seen = places_of(frame);
        }
        self.detects |= !frame.detections.is_empty();
        self
    }
}

/// Scores that differ are read by the law of all.
fn scores_of(frame: &DetectionFrame) -> ScoreModel {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    let scores = frame.detections.iter().map(|detection| detection.score);
    let mut counts = ScoreCounts::default();
    counts.add_frame(scores.fold(nothing, |[least, most], score| [least.min(score), most.max(score)]));
    counts.model()
}

/// As far as the view of all frames is known by their detections.
fn view_m_of(frame: &DetectionFrame) -> Option<f64> {
    let pose = frame.sensor_pose?;
    let mut statistics = SensorStatistics::default();
    for detection in &frame.detections {
        statistics.add_detection(Some(pose.distance_to(detection.bev.x, detection.bev.y)));
    }
    statistics.view_m()
}

/// Where it detects something.
fn places_of(frame: &DetectionFrame) -> SeenPlaces {
    let mut places = SeenPlaces::default();
    if let Some(pose) = &frame.sensor_pose {
        let axes = SensorAxes::of(pose);
        frame.detections.iter().for_each(|detection| places.note(&axes, [detection.bev.x, detection.bev.y]));
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learning::Prior;
    use crate::values::{SensingDefaults, SensorModel};
    use proptest::prelude::*;
    use v2x_common::class::Class;
    use v2x_common::covariance::{BoxCovariance, Covariance2};
    use v2x_common::detection::{Detection, HeadingKind};
    use v2x_common::geometry::{BevBox, Pose};
    use v2x_common::id::{AgentId, FrameId};
    use v2x_common::time::Timestamp;

    const SENSOR: Pose = Pose { x: 100.0, y: -50.0, yaw: 0.3 };

    /// A frame with detections of these ranges (m) and scores.
    fn frame(detections: &[(f64, f64)], sensor_pose: Option<Pose>) -> DetectionFrame {
        let covariance =
            BoxCovariance { position: Covariance2::isotropic(0.09), ww: 0.02, dd: 0.1, yaw: 0.01 };
        let detection = |(range_m, score): &(f64, f64)| Detection {
            class: Class::Car,
            score: *score,
            bev: BevBox { x: SENSOR.x + range_m, y: SENSOR.y, w: 1.9, d: 4.5, yaw: 0.0 },
            covariance,
            velocity: None,
            heading: HeadingKind::Known,
            source_track: None,
        };
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch: 1, sequence: 0 };
        DetectionFrame {
            sensor_pose,
            detections: detections.iter().map(detection).collect(),
            ..DetectionFrame::empty(id, Timestamp::EPOCH)
        }
    }

    fn prior() -> Prior {
        Prior::of(&SensorModel::undescribed(&SensingDefaults::default()).model())
    }

    #[test]
    fn the_first_frame_of_an_agent_has_a_view_and_scores_that_count() {
        let first = frame(&[(10.0, 0.9), (20.0, 0.5), (30.0, 0.15), (40.0, 0.7), (48.0, 0.3)], Some(SENSOR));
        let nothing = LearntSensor::default();
        let birth_odds = nothing.birth_odds(&prior());
        let reading = nothing.or_shown_by(&first).undescribed(&prior(), Some(SENSOR), birth_odds);
        assert!(
            reading.model.birth_odds < 0.5,
            "its score says what it is worth, and not yet that it is a new object"
        );
        let coverage = reading.coverage.unwrap();
        assert!(coverage.covers([SENSOR.x, SENSOR.y + 60.0], 0.0), "beyond what it detected");
        assert!(!coverage.covers([SENSOR.x, SENSOR.y + 90.0], 0.0), "but not far beyond");
        assert!(reading.model.scores.ln_odds(0.9) > 2.0 && reading.model.scores.ln_odds(0.12) < -2.0);
        assert_eq!(coverage.profile, reading.model.profile);
    }

    #[test]
    fn a_frame_that_shows_nothing_is_read_as_if_it_said_nothing() {
        let same_scores = [(10.0, 1.0), (20.0, 1.0), (30.0, 1.0), (40.0, 1.0), (48.0, 1.0)];
        let shown = LearntSensor::default().or_shown_by(&frame(&same_scores, Some(SENSOR)));
        assert_eq!(shown.scores, ScoreModel::Ignored, "equal scores are no evidence");
        let few = LearntSensor::default().or_shown_by(&frame(&[(10.0, 0.9), (20.0, 0.2)], Some(SENSOR)));
        assert_eq!(few.view_m, None, "two detections are no view");
        let placeless = LearntSensor::default().or_shown_by(&frame(&same_scores, None));
        assert_eq!(placeless.view_m, None, "from nowhere nothing is in view");
    }

    proptest! {
        #[test]
        fn what_is_learnt_is_not_overruled_by_a_frame(
            detections in prop::collection::vec((1.0..80.0_f64, 0.0..1.0_f64), 0..12),
            view_m in 20.0..200.0_f64,
        ) {
            let learnt = LearntSensor {
                view_m: Some(view_m),
                scores: ScoreModel::logistic(-0.5, 1.5),
                detects: true,
                ..LearntSensor::default()
            };
            prop_assert_eq!(learnt.or_shown_by(&frame(&detections, Some(SENSOR))), learnt);
        }

        #[test]
        fn the_order_of_detections_does_not_matter(
            mut detections in prop::collection::vec((1.0..80.0_f64, 0.0..1.0_f64), 0..12),
        ) {
            let shown = LearntSensor::default().or_shown_by(&frame(&detections, Some(SENSOR)));
            detections.reverse();
            let reversed = LearntSensor::default().or_shown_by(&frame(&detections, Some(SENSOR)));
            prop_assert_eq!(shown, reversed);
        }
    }
}
