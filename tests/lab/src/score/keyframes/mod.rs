//! Scores over keyframes: the paper's errors, and tracking metrics, of many scenes and trials.

pub(crate) mod by_position;
pub(crate) mod counting;
pub(crate) mod experiments;
pub(crate) mod method_score;
pub(crate) mod metrics;
pub(crate) mod moment;
pub(crate) mod scored_keyframe;
pub(crate) mod trackers;
