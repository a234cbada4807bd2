//! An agent's sensor model, from what it declares.

use super::class_law::ClassLaw;
use super::compact::DetectionEvidence;
use super::detection_profile::DetectionProfile;
use super::existence::{Persistence, SURVIVAL_TIME_S};
use super::heading_law::HeadingLaw;
use super::measurement::{Measurement, SizeLaw};
use super::pose_errors::PoseErrors;
use super::position_errors::PositionErrors;
use super::score_model::{ScoreBand, ScoreModel};
use super::seen_places::SeenFrom;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use v2x_common::class::ClassGroup;
use v2x_common::detection::Detection;
use v2x_common::geometry::Pose;
use v2x_common::sensor::{Body, FieldOfView, SensorDescription, SizeNoiseLaw};

/// Upper limit of declared detection probabilities: one missed detection must not be proof.
const MAX_DETECTION_PROBABILITY: f64 = 0.999;
/// Frame rate of an agent that declares none, Hz.
const UNDECLARED_RATE_HZ: f64 = 10.0;
/// An object is expected in at least this share of the frames.
const LEAST_REPORTED: f64 = 0.333;
/// A track further than this beyond a sensor's range was not covered, whatever late data changes, m.
const COVERAGE_SLACK_M: f64 = 20.0;

/// Assumptions about agents that describe no sensor, and about new objects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensingDefaults {
    /// Detection probability of an agent that declares none, until it is learnt; without learning its misses count for
    /// nothing.
    pub detection_probability: f64,
    /// Expected false detections of such an agent in a frame, per m².
    pub clutter_per_m2: f64,
    /// Expected objects that come into view, per m² and second. The number that is new to a frame
    /// follows from the declared rate of frames.
    pub births_per_m2_s: f64,
}

impl Default for SensingDefaults {
    fn default() -> Self {
        Self { detection_probability: 0.7, clutter_per_m2: 1e-3, births_per_m2_s: 1e-4 }
    }
}

/// One agent's sensor: how its detections become measurements, and their evidence of existence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorModel {
    model: DetectionModel,
    size_law: Option<SizeLaw>,
}

/// How the frames of a sensor are read as evidence of existence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DetectionModel {
    /// Detection probabilities.
    pub profile: DetectionProfile,
    /// Expected false detections in a frame, per m².
    pub clutter_per_m2: f64,
    /// Odds that a detection of no known track is of a real object.
    pub birth_odds: f64,
    /// Mean time between frames, s.
    pub interval_s: f64,
    /// What bounds existence.
    pub persistence: Persistence,
    /// How scores are read.
    pub scores: ScoreModel,
    /// Whether what it detects is nearly always real, and no scores say so: then it is not given up where another one is silent.
    pub is_trusted: bool,
    /// How headings err.
    pub headings: HeadingLaw,
    /// How errors of position differ from what is declared.
    pub errors: PositionErrors,
    /// What is unknown of the sensor's pose.
    pub pose: PoseErrors,
    /// How classes err.
    pub classes: ClassLaw,
    /// Whether an object's history by this sensor counts: whether its last frame held it, and how well it supports it.
    pub keeps_support: bool,
}

impl Default for DetectionModel {
    fn default() -> Self {
        Self {
            profile: DetectionProfile::uniform(1.0),
            clutter_per_m2: 0.0,
            birth_odds: 0.0,
            interval_s: 1.0 / UNDECLARED_RATE_HZ,
            persistence: Persistence::default(),
            scores: ScoreModel::Ignored,
            is_trusted: false,
            headings: HeadingLaw::AsReported,
            errors: PositionErrors::AS_DECLARED,
            pose: PoseErrors::NONE,
            classes: ClassLaw::UNKNOWN,
            keeps_support: false,
        }
    }
}

impl DetectionModel {
    /// Of a sensor with this detection probability, clutter density (1/m²) and rate of frames (Hz).
    ///
    /// Objects that came into view since the previous frame are new to a frame: more of them at a lower rate, but at
    /// most those of the mean survival time.
    fn new(
        (detection_probability, clutter_per_m2): (f64, f64),
        rate_hz: f64,
        defaults: &SensingDefaults,
    ) -> Self {
        let births_per_m2 = defaults.births_per_m2_s / rate_hz.max(1.0 / SURVIVAL_TIME_S);
        Self {
            profile: DetectionProfile::uniform(limited(detection_probability)),
            clutter_per_m2,
            birth_odds: births_per_m2 / clutter_per_m2,
            interval_s: 1.0 / rate_hz,
            ..Self::default()
        }
    }

    /// Detection probability over clutter density of a detection of this group at this range (m), m²; ∞ without clutter.
    pub fn detection_over_clutter(&self, range_m: f64, group: ClassGroup) -> f64 {
        self.profile.probability(range_m, group) / self.clutter_per_m2
    }

    /// Mean time between detections of an object that a frame holds with this probability, s: an agent may report a part of its
    /// objects in each frame.
    #[inline]
    pub fn detection_interval_s(&self, probability: f64) -> f64 {
        self.interval_s / probability.max(LEAST_REPORTED)
    }

    /// A detection's evidence of existence, by its distance from the sensor, where that is known, and its score.
    pub fn evidence(&self, detection: &Detection, sensor: Option<&Pose>) -> DetectionEvidence {
        let sensor = sensor.filter(|_| self.profile.depends_on_range());
        let range_m = sensor.map_or(0.0, |pose| pose.distance_to(detection.bev.x, detection.bev.y));
        let score = self.scores.evidence(detection.score);
        DetectionEvidence {
            over_clutter: self.detection_over_clutter(range_m, detection.class.group()) * score.factor(),
            score,
            band: ScoreBand::of(detection.score),
        }
    }
}

fn limited(detection_probability: f64) -> f64 {
    detection_probability.min(MAX_DETECTION_PROBABILITY)
}

/// What a frame covers: the region in which an object without a detection was missed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Pose of the sensor.
    pub pose: Pose,
    /// Its field of view.
    pub field_of_view: FieldOfView,
    /// The body of the vehicle that carries it, inside which it detects nothing.
    pub body: Option<Body>,
    /// Probabilities that an object in the field of view is detected.
    pub profile: DetectionProfile,
    /// Where it has detected anything; `None` of a field of view that is declared.
    pub seen: Option<SeenFrom>,
}

impl Coverage {
    /// Whether an object at this position (m) was covered, by at least a margin (m): borders are uncertain.
    pub fn covers(&self, [x, y]: [f64; 2], margin_m: f64) -> bool {
        self.field_of_view.contains_within(&self.pose, x, y, margin_m)
            && !self.body.is_some_and(|body| {
                self.pose.distance_to(x, y) < body.at(&self.pose).circumradius() + margin_m
            })
    }

    /// Probability that an object of a group at a position (m) in the field of view is detected.
    #[inline]
    pub fn detection_probability(&self, position: [f64; 2], group: ClassGroup) -> f64 {
        let probability = self.profile.probability(self.range_for_profile(position), group);
        match &self.seen {
            Some(seen) => probability * seen.probability(position),
            None => probability,
        }
    }

    /// Whether it is known to see objects about a position, m.
    pub fn is_known_to_see(&self, position: [f64; 2]) -> bool {
        self.seen.as_ref().is_none_or(|seen| seen.hold(position))
    }

    /// Distance of a position (m) from the sensor, m.
    #[inline]
    pub fn range_to(&self, [x, y]: [f64; 2]) -> f64 {
        self.pose.distance_to(x, y)
    }

    /// Distance of a position (m) from the sensor, m, as far as the profile depends on it.
    #[inline]
    pub fn range_for_profile(&self, position: [f64; 2]) -> f64 {
        if self.profile.depends_on_range() { self.range_to(position) } else { 0.0 }
    }

    /// Whether an object near this position (m) was covered, or may have been after late data has moved
    /// its track.
    pub fn may_cover(&self, [x, y]: [f64; 2]) -> bool {
        self.pose.distance_to(x, y) <= self.field_of_view.range_max_m + COVERAGE_SLACK_M
    }
}

impl Default for SensorModel {
    fn default() -> Self {
        Self::undescribed(&SensingDefaults::default())
    }
}

impl SensorModel {
    /// Of an agent that describes no sensor.
    pub fn undescribed(defaults: &SensingDefaults) -> Self {
        let SensingDefaults { detection_probability, clutter_per_m2, .. } = *defaults;
        let model =
            DetectionModel::new((detection_probability, clutter_per_m2), UNDECLARED_RATE_HZ, defaults);
        Self::new(model, None)
    }

    /// Of a described sensor.
    pub fn described(description: &SensorDescription, defaults: &SensingDefaults) -> Self {
        let SensorDescription { detection_probability, clutter_per_m2, size_noise, rate_hz, .. } =
            *description;
        let model = DetectionModel::new((detection_probability, clutter_per_m2), rate_hz, defaults);
        Self::new(model, size_noise)
    }

    fn new(model: DetectionModel, size_noise: Option<SizeNoiseLaw>) -> Self {
        Self { model, size_law: size_noise.as_ref().map(moments) }
    }

    /// Each detection's evidence of existence.
    pub const fn model(&self) -> DetectionModel {
        self.model
    }

    /// A detection as a measurement.
    pub fn measurement(&self, detection: &Detection) -> Measurement {
        let Detection { bev, covariance, .. } = detection;
        let [w, d] = [(bev.w, covariance.ww), (bev.d, covariance.dd)]
            .map(|(reported, variance)| Debiased::of(reported, variance, self.size_law));
        Measurement {
            class: detection.class,
            position: [bev.x, bev.y],
            r: covariance.position,
            size: [w.size, d.size],
            relative_variance: [w.relative_variance, d.relative_variance],
            size_law: [w.law, d.law],
            yaw: bev.yaw,
            yaw_variance: covariance.yaw,
            heading: detection.heading,
            velocity: detection.velocity,
            is_track: detection.source_track.is_some(),
            since_last_s: f64::INFINITY,
        }
    }

    /// What a frame of this sensor covers.
    pub fn coverage(&self, description: &SensorDescription, pose: Pose) -> Coverage {
        Coverage {
            pose,
            field_of_view: description.field_of_view,
            body: description.body,
            profile: self.model.profile,
            seen: None,
        }
    }
}

/// Moments of a normal of mean 1 and standard deviation σ, truncated below (Burkardt 2014, section 2.3).
fn moments(law: &SizeNoiseLaw) -> SizeLaw {
    let a = (law.lower - 1.0) / law.sigma;
    let density = libm::exp(-a * a / 2.0) / libm::sqrt(2.0 * PI);
    let kept = libm::erfc(a / libm::sqrt(2.0)) / 2.0;
    let hazard = density / kept;
    let mean = 1.0 + law.sigma * hazard;
    let variance = law.sigma * law.sigma * (1.0 + a * hazard - hazard * hazard);
    let relative_variance = variance / (mean * mean);
    SizeLaw { variance: law.sigma * law.sigma, lower: law.lower, mean, relative_variance }
}

/// A reported size with its sensor's bias removed.
#[derive(Clone, Copy)]
struct Debiased {
    /// m.
    size: f64,
    relative_variance: f64,
    law: Option<SizeLaw>,
}

impl Debiased {
    /// Of a reported size (m) with its variance (m²).
    ///
    /// A report that states a much smaller error than the law (an agent's own, known body) keeps its own.
    fn of(reported: f64, variance: f64, law: Option<SizeLaw>) -> Self {
        let stated = variance / (reported * reported);
        match law {
            Some(law) if stated > law.relative_variance / 4.0 => {
                Self { size: reported / law.mean, relative_variance: law.relative_variance, law: Some(law) }
            }
            _ => Self { size: reported, relative_variance: stated, law: None },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_laws_moments_are_those_of_the_truncated_normal() {
        // deploy/docs/methods.md: mean and coefficient of variation of N1, N2, N3 with lower bound 0.1.
        for (sigma, mean, cv) in [(0.2, 1.000, 0.200), (0.5, 1.041, 0.442), (1.0, 1.326, 0.584)] {
            let SizeLaw { mean: m, relative_variance, .. } = moments(&SizeNoiseLaw { sigma, lower: 0.1 });
            assert!((m - mean).abs() < 1e-3, "mean {m} at sigma {sigma}");
            assert!((libm::sqrt(relative_variance) - cv).abs() < 1e-3, "cv at sigma {sigma}");
        }
    }

    #[test]
    fn the_birth_intensity_per_second_does_not_depend_on_the_frame_rate() {
        let odds =
            |rate_hz| DetectionModel::new((0.9, 1e-5), rate_hz, &SensingDefaults::default()).birth_odds;
        assert!((odds(10.0) - 1.0).abs() < 1e-12);
        assert!((odds(2.0) - 5.0).abs() < 1e-12);
        assert!((odds(0.001) / odds(0.01) - 1.0).abs() < 1e-12, "no longer than the survival time");
    }

    #[test]
    fn without_clutter_the_first_detection_is_certain() {
        let defaults = SensingDefaults { clutter_per_m2: 0.0, ..SensingDefaults::default() };
        let sensing = SensorModel::undescribed(&defaults);
        let first = crate::values::Existence::from_odds(sensing.model().birth_odds);
        assert!(first.probability() > 0.99);
    }
}
