//! What is learnt of a sensor, in the units of people.

use crate::values::{ClassLaw, DetectionProfile, HeadingLaw, RANGE_BIN_M, RANGE_BINS, ScoreModel};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::class::ClassGroup;
use v2x_common::sensor::SensorDescription;

/// Turned headings are reported from this share on, classes where the share of right ones is lower.
const MIN_TURNED: f64 = 0.03;
const MIN_CLASSES_RIGHT: f64 = 0.9;
/// A group of classes is reported by itself from so many frames of objects on, and said where its detection probability differs from
/// that of all by so much.
const GROUP_FRAMES: f64 = 50.0;
const GROUP_DIFFERS: f64 = 0.1;
/// False detections in a frame are said from this number on.
const LEAST_FALSE: f64 = 0.5;

/// What is learnt of an agent's sensor from what it and others report: to be held against what the agent declares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearntSensorReport {
    /// Frames of objects that could hold a detection, by which the detection probability is judged; older ones count less.
    pub observed_frames: u64,
    /// Probability that an object in view is detected; `None` before any such frame.
    pub detection_probability: Option<f64>,
    /// The same by distance, as far as detections come from, in steps of `range_step_m`.
    pub detection_probability_by_range: Vec<f64>,
    /// m.
    pub range_step_m: f64,
    /// The same of the groups of classes of which enough was seen.
    pub detection_probability_by_class: BTreeMap<String, f64>,
    /// Correlation of one frame with the next: misses come in runs.
    pub detection_correlation: f64,
    /// Whether this contradicts the declared detection probability, so that frames are read by what is learnt; always of an
    /// agent that declares nothing.
    pub overrules_declared: bool,
    /// False detections in a frame: of what no track turned out to be real by; `None` before any frame.
    pub false_per_frame: Option<f64>,
    /// Expected false detections in a frame, per m² of its view; `None` until that is known.
    pub clutter_per_m2: Option<f64>,
    /// Whether this contradicts the declared density, so that frames are read by what is learnt; always of an agent that declares
    /// nothing.
    pub overrules_declared_clutter: bool,
    /// Distance within which nearly all detections are, m.
    pub range_m: Option<f64>,
    /// Frames per second.
    pub rate_hz: Option<f64>,
    /// Whether its scores differ, and so are evidence.
    pub uses_scores: bool,
    /// The score at which something is real in one case of two; `None` where scores say nothing, or no score is such.
    pub even_score: Option<f64>,
    /// Share of headings that are turned by half a turn.
    pub turned_headings: f64,
    /// Constant error of headings, degrees; 0 where none is significant.
    pub heading_offset_deg: f64,
    /// Standard deviation of the part of its errors of heading that lasts for seconds, degrees.
    pub lasting_heading_sigma_deg: f64,
    /// Factor on its declared standard deviations of position; 1 where they are about right.
    pub sigma_factor: f64,
    /// Standard deviation of the part of its errors of position that lasts for seconds, m.
    pub lasting_sigma_m: f64,
    /// Standard deviation of its pose, by which all that stands moves at once in its reports, m; 0 where none is significant.
    pub pose_sigma_m: f64,
    /// Probability that its class is right.
    pub class_right: f64,
    /// Probability that its class is another one of the right group.
    pub class_within_group: f64,
}

/// What of the report comes from counts.
pub(super) struct Counted<'a> {
    pub(super) observed_frames: f64,
    pub(super) detected_frames: f64,
    pub(super) profile: DetectionProfile,
    pub(super) overrules_declared: bool,
    pub(super) range_m: Option<f64>,
    pub(super) interval_s: Option<f64>,
    pub(super) scores: ScoreModel,
    pub(super) headings: &'a HeadingLaw,
    pub(super) variance_factor: f64,
    pub(super) lasting_variance: f64,
    pub(super) pose_variance: f64,
    pub(super) classes: ClassLaw,
    /// Detected and all frames of objects, by their group of classes.
    pub(super) groups: Vec<(ClassGroup, [f64; 2])>,
    pub(super) false_per_frame: Option<f64>,
    pub(super) clutter_per_m2: Option<f64>,
    pub(super) overrules_declared_clutter: bool,
}

impl LearntSensorReport {
    pub(super) fn of(counted: &Counted<'_>) -> Self {
        let (turned_headings, offset, lasting) = match *counted.headings {
            HeadingLaw::AsReported => (0.0, 0.0, 0.0),
            HeadingLaw::Mixture { front_odds_ln, offset, lasting, .. } => {
                (1.0 / (1.0 + libm::exp(front_odds_ln)), offset, lasting)
            }
        };
        let steps = counted.range_m.map_or(0.0, |range_m| libm::ceil(range_m / RANGE_BIN_M));
        #[expect(clippy::cast_precision_loss, reason = "a few")]
        let by_range = (0..RANGE_BINS)
            .map(|step| step as f64)
            .take_while(|step| *step < steps)
            .map(|step| counted.profile.of_all((step + 0.5) * RANGE_BIN_M));
        let observed = counted.observed_frames;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let observed_frames = libm::round(observed) as u64;
        Self {
            observed_frames,
            detection_probability: (observed > 0.0).then(|| counted.detected_frames / observed),
            detection_probability_by_range: by_range.collect(),
            range_step_m: RANGE_BIN_M,
            detection_probability_by_class: by_class(&counted.groups),
            false_per_frame: counted.false_per_frame,
            clutter_per_m2: counted.clutter_per_m2,
            overrules_declared_clutter: counted.overrules_declared_clutter,
            detection_correlation: counted.profile.correlation(),
            overrules_declared: counted.overrules_declared,
            range_m: counted.range_m,
            rate_hz: counted.interval_s.map(|interval_s| 1.0 / interval_s),
            uses_scores: counted.scores != ScoreModel::Ignored,
            even_score: even_score(&counted.scores),
            turned_headings,
            heading_offset_deg: offset.to_degrees(),
            lasting_heading_sigma_deg: libm::sqrt(lasting).to_degrees(),
            sigma_factor: libm::sqrt(counted.variance_factor),
            lasting_sigma_m: libm::sqrt(counted.lasting_variance),
            pose_sigma_m: libm::sqrt(counted.pose_variance),
            class_right: counted.classes.right,
            class_within_group: counted.classes.within_group,
        }
    }

    /// Whether somebody should know of it: the sensor is not as it declares, or as a good one is.
    pub fn is_remarkable(&self, is_described: bool) -> bool {
        (is_described && (self.overrules_declared || self.overrules_declared_clutter))
            || self.turned_headings >= MIN_TURNED
            || self.heading_offset_deg != 0.0
            || self.sigma_factor != 1.0
            || self.pose_sigma_m > 0.0
            || self.class_right < MIN_CLASSES_RIGHT
    }

    /// In words: what is worth knowing, beside what the sensor declares.
    pub fn in_words(&self, declared: Option<&SensorDescription>) -> String {
        let mut words = Vec::new();
        if let Some(probability) = self.detection_probability {
            let held_against = match declared {
                Some(SensorDescription { detection_probability, .. }) if self.overrules_declared => {
                    format!(" (declared {detection_probability:.2}: overruled)")
                }
                Some(SensorDescription { detection_probability, .. }) => {
                    format!(" (declared {detection_probability:.2})")
                }
                None => String::new(),
            };
            words.push(format!("detects {:.0} %{held_against}", 100.0 * probability));
            let groups = self.detection_probability_by_class.iter();
            let apart = groups.filter(|(_, of_group)| (**of_group - probability).abs() >= GROUP_DIFFERS);
            words.extend(apart.map(|(name, of_group)| format!("of {name} {:.0} %", 100.0 * of_group)));
        }
        words.extend(self.clutter_in_words(declared));
        if let Some(range_m) = self.range_m {
            words.push(format!("within {range_m:.0} m"));
        }
        if self.turned_headings >= MIN_TURNED {
            words.push(format!("{:.0} % of headings turned round", 100.0 * self.turned_headings));
        }
        if self.heading_offset_deg != 0.0 {
            words.push(format!("headings off by {:.0}°", self.heading_offset_deg));
        }
        if self.lasting_heading_sigma_deg > 0.0 {
            words.push(format!("errors of {:.1}° that last", self.lasting_heading_sigma_deg));
        }
        if self.sigma_factor != 1.0 {
            words.push(format!("σ of positions × {:.2}", self.sigma_factor));
        }
        if self.lasting_sigma_m > 0.0 {
            words.push(format!("errors of {:.2} m that last", self.lasting_sigma_m));
        }
        if self.pose_sigma_m > 0.0 {
            words.push(format!("a pose that wanders by {:.1} m", self.pose_sigma_m));
        }
        if let Some(score) = self.even_score {
            words.push(format!("a score of {score:.2} is real in one case of two"));
        }
        if self.class_right < MIN_CLASSES_RIGHT {
            words.push(format!("classes right in {:.0} %", 100.0 * self.class_right));
        }
        words.join(", ")
    }

    fn clutter_in_words(&self, declared: Option<&SensorDescription>) -> Option<String> {
        let per_frame = self.false_per_frame?;
        let expected = declared.map(|declared| declared.clutter_per_m2 * declared.field_of_view.area_m2());
        let held_against = match expected {
            Some(expected) if self.overrules_declared_clutter => {
                format!(" (declared {expected:.2}: overruled)")
            }
            Some(expected) => format!(" (declared {expected:.2})"),
            None => String::new(),
        };
        let is_worth_it = per_frame >= LEAST_FALSE || (expected.is_some() && self.overrules_declared_clutter);
        is_worth_it.then(|| format!("{per_frame:.1} false a frame{held_against}"))
    }
}

fn by_class(groups: &[(ClassGroup, [f64; 2])]) -> BTreeMap<String, f64> {
    let known = groups.iter().filter(|(_, [_, all])| *all >= GROUP_FRAMES);
    known.map(|(group, [detected, all])| (group.name().to_owned(), detected / all)).collect()
}

/// The least score, in hundredths, from which on something is rather real than not.
fn even_score(scores: &ScoreModel) -> Option<f64> {
    let hundredths = (1..100).map(|percent| f64::from(percent) / 100.0);
    let even = hundredths.into_iter().find(|score| scores.ln_odds(*score) > -1e-3)?;
    (*scores != ScoreModel::Ignored && even > 0.01).then_some(even)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::logit;
    use v2x_common::sensor::{Accuracy, FieldOfView, SensorKind};

    fn report(headings: &HeadingLaw, overrules_declared: bool) -> LearntSensorReport {
        LearntSensorReport::of(&Counted {
            observed_frames: 200.4,
            detected_frames: 120.0,
            profile: DetectionProfile::uniform(0.6),
            overrules_declared,
            range_m: Some(45.0),
            interval_s: Some(0.1),
            scores: ScoreModel::logistic(logit(0.4), 2.0),
            headings,
            variance_factor: 4.0,
            lasting_variance: 0.09,
            pose_variance: 0.25,
            classes: ClassLaw { right: 0.8, within_group: 0.19 },
            groups: vec![
                (ClassGroup::FourWheeled, [90.0, 100.0]),
                (ClassGroup::Pedestrian, [30.0, 100.0]),
                (ClassGroup::TwoWheeled, [0.0, 0.4]),
            ],
            false_per_frame: Some(2.25),
            clutter_per_m2: Some(2e-4),
            overrules_declared_clutter: overrules_declared,
        })
    }

    #[test]
    fn what_is_learnt_is_reported_in_words_beside_what_is_declared() {
        let turned = HeadingLaw::Mixture {
            front_odds_ln: 0.0,
            offset: 0.5,
            lasting: 0.01,
            lasting_share: 0.0,
            standing: 1.0,
        };
        let declared = SensorDescription {
            revision: 1,
            kind: SensorKind::Vehicle,
            field_of_view: FieldOfView::omnidirectional(0.0, 50.0),
            detection_probability: 0.95,
            clutter_per_m2: 1e-5,
            size_noise: None,
            body: None,
            accuracy: Accuracy { position_m: 0.1, yaw_rad: 0.01, clock_s: 0.001 },
            rate_hz: 10.0,
        };
        let words = report(&turned, true).in_words(Some(&declared));
        for part in [
            "detects 60 % (declared 0.95: overruled)",
            "of cars and larger 90 %, of people 30 %",
            "2.2 false a frame (declared 0.08: overruled)",
            "within 45 m",
            "50 % of headings turned round",
            "headings off by 29°",
            "σ of positions × 2.00",
            "errors of 0.30 m that last",
            "classes right in 80 %",
            "a score of 0.40 is real in one case of two",
        ] {
            assert!(words.contains(part), "{part:?} is missing in {words:?}");
        }
        let plain = report(&HeadingLaw::AsReported, true).in_words(None);
        assert!(plain.contains("detects 60 %,") && !plain.contains("headings"), "{plain}");
        assert!(!plain.contains("two-wheelers") && !plain.contains("declared"), "{plain}");
    }

    #[test]
    fn probabilities_are_listed_as_far_as_detections_come_from() {
        let report = report(&HeadingLaw::AsReported, false);
        assert_eq!(report.detection_probability_by_range, [0.6; 5]);
        assert_eq!((report.observed_frames, report.rate_hz), (200, Some(10.0)));
    }
}
