//! Plain values that every layer above uses. They do not depend on tracks, filters or agents' statistics.
//!
//! [`Measurement`] is a detection as a filter takes it in, [`SensorModel`] turns detections into measurements by what
//! an agent declares, [`PredictedMeasurement`] is what a track expects of a frame, [`Existence`] the probability that
//! a track is of a real object.

mod agents;
pub(crate) mod arrays;
mod class_belief;
mod class_law;
mod coast;
mod compact;
mod contributor_limit;
mod detection_profile;
mod exclusion;
mod existence;
mod exponential;
mod heading_law;
mod innovation;
mod measurement;
pub mod overlap;
mod particle_set;
mod pose_errors;
mod position_errors;
mod predicted;
mod real;
mod saved;
mod score_model;
mod seen_places;
mod sensor_model;
mod support;

pub use agents::{AgentNames, AgentSlot};
pub use class_belief::{AgentClasses, ClassBelief, ClassShares};
pub use class_law::ClassLaw;
pub use coast::Coast;
pub use compact::{CompactMeasurement, DetectionEvidence, SizeLaws};
pub use contributor_limit::ContributorLimit;
pub(crate) use detection_profile::with_factor;
pub use detection_profile::{CLASS_GROUPS, DetectionProfile, Groups, RANGE_BIN_M, RANGE_BINS, range_bin};
pub use exclusion::Body;
pub use existence::{Existence, Persistence, SURVIVAL_TIME_S};
pub(crate) use exponential::share_lost;
pub use heading_law::{HeadingLaw, Turn};
pub use innovation::PositionInnovation;
pub use measurement::{Measurement, SizeLaw};
pub use particle_set::{MAX_PARTICLES, ParticleSet};
pub use pose_errors::{MOST_ACCURACY, PoseDetection, PoseErrors, SharedError, Widened};
pub use position_errors::{LastingError, PositionErrors};
pub use predicted::{ExpectedPlace, PredictedMeasurement};
pub use real::{LANES, Real};
pub(crate) use saved::saved;
pub use saved::{Saved, StateError};
pub use score_model::{SCORE_BANDS, ScoreBand, ScoreEvidence, ScoreModel, logit};
pub use seen_places::{SeenFrom, SeenPlaces, SensorAxes};
pub use sensor_model::{Coverage, DetectionModel, SensingDefaults, SensorModel};
pub use support::{Support, SupportFrame};

#[cfg(test)]
pub(crate) use {
    class_belief::listed as classes_listed, coast::listed as coast_listed,
    exclusion::listed as exclusion_listed, existence::listed as existence_listed,
    heading_law::listed as headings_listed, pose_errors::listed as pose_errors_listed,
    position_errors::listed as position_errors_listed, seen_places::listed as seen_places_listed,
    support::listed as support_listed,
};
