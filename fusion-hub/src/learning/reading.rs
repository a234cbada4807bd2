//! How a frame is read as evidence, by what its agent declares and by what was learnt of it.

use super::detection_counts::{DetectionCounts, ProfilePrior};
use crate::values::{
    ClassLaw, Coverage, DetectionModel, DetectionProfile, HeadingLaw, Persistence, PoseErrors,
    PositionErrors, RANGE_BINS, ScoreModel, SeenPlaces, SensingDefaults,
};
use serde::{Deserialize, Serialize};
use v2x_common::geometry::Pose;
use v2x_common::sensor::FieldOfView;

/// Time between frames until it is known, s: objects of a slow sensor are not to vanish before its second frame.
const UNKNOWN_INTERVAL_S: f64 = 0.28;
/// Correlation of successive frames of an undescribed sensor, until it is learnt.
const UNDESCRIBED_CORRELATION: f64 = 0.5;
/// What an agent that detects nothing at all misses counts as one miss in so long, s, with this detection probability at most: it
/// may be dead, and others may be slow.
const SILENT_FOR_S: f64 = 2.0;
const SILENT: f64 = 0.8;
/// Odds of a new object that an undescribed agent's detection has at least and at most. Where its scores are learnt, their odds are
/// those of a detection that nothing else is known of, and nothing else reduces them.
const BIRTH_ODDS: [f64; 2] = [0.05, 1.0];
/// The odds of a score hold how many detections are false. What remains of the density of false detections is that of
/// objects: some twenty within 50 m, 2.5 times the density of false detections that is assumed.
const OBJECTS_OVER_CLUTTER: f64 = 2.5;

/// What is assumed of an agent that describes no sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    /// Detection probabilities.
    pub(crate) profile: ProfilePrior,
    /// Expected false detections in a frame, per m².
    pub(crate) clutter_per_m2: f64,
    /// Odds that a detection is of a new object, for each second since the agent's last frame.
    pub(crate) birth_odds_per_s: f64,
}

impl Prior {
    /// By what is assumed of a sensor in the settings. Misses come in runs.
    pub(crate) fn of(model: &DetectionModel) -> Self {
        Self {
            profile: ProfilePrior {
                probability: model.profile.of_all(0.0),
                correlation: UNDESCRIBED_CORRELATION,
            },
            clutter_per_m2: model.clutter_per_m2,
            birth_odds_per_s: model.birth_odds / model.interval_s,
        }
    }
}

/// What was learnt of an agent by some time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LearntSensor {
    /// Detection probabilities; `None` where those declared hold.
    pub(super) profile: Option<DetectionProfile>,
    /// Expected false detections in a frame, per m²; `None` where those declared or assumed hold.
    pub(super) clutter_per_m2: Option<f64>,
    /// Whether what it detects is nearly always real.
    pub(super) is_trusted: bool,
    /// How far its view reaches, m.
    pub(super) view_m: Option<f64>,
    /// Where about itself it has detected anything.
    pub(super) seen: SeenPlaces,
    /// Time between frames, s.
    pub(super) interval_s: Option<f64>,
    /// How its headings err.
    pub(super) headings: Option<HeadingLaw>,
    /// How its errors of position are.
    pub(super) errors: PositionErrors,
    /// Variance along an axis of what may last of its errors of position and shows nowhere, m²: it is published.
    pub(super) unseen: f64,
    /// Variance of its pose's position along an axis, m².
    pub(super) pose_variance: f64,
    /// How its classes err.
    pub(super) classes: ClassLaw,
    /// How its scores are read.
    pub(super) scores: ScoreModel,
    /// Whether it has detected anything lately.
    pub(super) detects: bool,
}

/// How a frame is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameReading {
    /// As evidence of existence.
    pub(crate) model: DetectionModel,
    /// What it covers; `None` where its missed detections do not count.
    pub(crate) coverage: Option<Coverage>,
}

/// Odds of a new object in a time (s) where as many come into view as before, but false detections have another density, 1/m². Where there
/// were none by declaration, nothing is known of how many come into view.
fn birth_odds(before: f64, [clutter_before, clutter]: [f64; 2], passed_s: f64) -> f64 {
    if before.is_finite() {
        before * (clutter_before / clutter)
    } else if clutter > 0.0 {
        SensingDefaults::default().births_per_m2_s * passed_s / clutter
    } else {
        before
    }
}

/// How the misses of an agent that detects nothing are read, with this time between its frames.
fn silent(profile: &DetectionProfile, interval_s: f64) -> DetectionProfile {
    let share = (interval_s / SILENT_FOR_S).min(1.0);
    profile.map(|probability| probability.min(SILENT) * share)
}

impl LearntSensor {
    /// Reads a frame of an agent that describes its sensor.
    pub(super) fn described(&self, declared: &FrameReading) -> FrameReading {
        let mut reading = *declared;
        // Where detection probability and clutter are declared, existence holds all there is but for the scores.
        reading.model.keeps_support = self.scores != ScoreModel::Ignored;
        reading.model.scores = self.scores;
        reading.model.headings = self.headings.unwrap_or(HeadingLaw::UNKNOWN);
        reading.model.errors = self.errors;
        reading.model.pose = self.pose();
        reading.model.classes = self.classes;
        if let Some(profile) = self.profile {
            reading.model.profile = profile;
            reading.model.persistence = Persistence::by_rate(declared.model.interval_s);
        }
        if let Some(clutter) = self.clutter_per_m2 {
            let model = &mut reading.model;
            model.birth_odds =
                birth_odds(model.birth_odds, [model.clutter_per_m2, clutter], model.interval_s);
            model.clutter_per_m2 = clutter;
        }
        if let Some(coverage) = &mut reading.coverage {
            coverage.profile = if self.detects {
                reading.model.profile
            } else {
                silent(&reading.model.profile, declared.model.interval_s)
            };
        }
        reading
    }

    /// Odds of a new object that a detection of an agent that describes no sensor has: cautious until its scores are learnt, which
    /// then say it.
    pub(super) fn birth_odds(&self, prior: &Prior) -> f64 {
        let [least, most] = BIRTH_ODDS;
        let (least, clutter) = match self.scores {
            ScoreModel::Ignored => (least, self.clutter_per_m2.unwrap_or(prior.clutter_per_m2)),
            _ => (most, prior.clutter_per_m2),
        };
        let per_s = birth_odds(prior.birth_odds_per_s, [prior.clutter_per_m2, clutter], 1.0);
        (per_s * self.interval_s.unwrap_or(UNKNOWN_INTERVAL_S)).clamp(least, most)
    }

    /// Reads a frame of an agent that describes no sensor, from a pose where that is known; with the odds of
    /// [`Self::birth_odds`].
    pub(super) fn undescribed(&self, prior: &Prior, pose: Option<Pose>, birth_odds: f64) -> FrameReading {
        let profile =
            self.profile.unwrap_or_else(|| DetectionCounts::default().profile(prior.profile, RANGE_BINS));
        let interval_s = self.interval_s.unwrap_or(UNKNOWN_INTERVAL_S);
        let clutter_per_m2 = match self.scores {
            ScoreModel::Ignored => self.clutter_per_m2.unwrap_or(prior.clutter_per_m2),
            _ => OBJECTS_OVER_CLUTTER * prior.clutter_per_m2,
        };
        let model = DetectionModel {
            profile,
            clutter_per_m2,
            birth_odds,
            interval_s,
            persistence: Persistence::by_rate(interval_s),
            scores: self.scores,
            is_trusted: self.is_trusted && self.scores == ScoreModel::Ignored,
            headings: self.headings.unwrap_or(HeadingLaw::UNDESCRIBED),
            errors: self.errors,
            pose: self.pose(),
            classes: self.classes,
            keeps_support: true,
        };
        let view = |(pose, view_m)| Coverage {
            pose,
            field_of_view: FieldOfView::omnidirectional(0.0, view_m),
            body: None,
            profile,
            seen: Some(self.seen.from_pose(&pose)),
        };
        FrameReading { model, coverage: pose.zip(self.view_m).map(view) }
    }

    /// What is unknown of its pose, where it declares nothing.
    fn pose(&self) -> PoseErrors {
        PoseErrors { position: self.pose_variance, yaw: 0.0 }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![
        ("learning.undescribed_correlation", UNDESCRIBED_CORRELATION.to_string()),
        ("learning.birth_odds", format!("{BIRTH_ODDS:?}, with learnt scores the most")),
        ("learning.objects_over_clutter", OBJECTS_OVER_CLUTTER.to_string()),
        ("learning.silent", format!("{SILENT} in {SILENT_FOR_S} s")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odds_of_a_new_object_follow_the_density_of_false_detections_and_are_a_number_where_none_were_declared()
    {
        assert!((birth_odds(0.2, [1e-3, 1e-4], 0.1) - 2.0).abs() < 1e-12);
        let learnt = birth_odds(f64::INFINITY, [0.0, 1e-4], 0.1);
        assert!((learnt - 0.1).abs() < 1e-12, "{learnt}");
        assert_eq!(birth_odds(f64::INFINITY, [0.0, 0.0], 0.1), f64::INFINITY);
        let certain = Prior {
            profile: ProfilePrior { probability: 0.7, correlation: 0.5 },
            clutter_per_m2: 0.0,
            birth_odds_per_s: f64::INFINITY,
        };
        for clutter_per_m2 in [None, Some(0.0), Some(1e-3)] {
            let learnt = LearntSensor { clutter_per_m2, ..LearntSensor::default() };
            assert!((BIRTH_ODDS[0]..=BIRTH_ODDS[1]).contains(&learnt.birth_odds(&certain)));
        }
    }
}
