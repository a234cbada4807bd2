//! How methods do over keyframes: the paper's errors, and tracking metrics, of many scenes and trials.

pub mod by_position;
pub mod counting;
pub mod experiments;
pub mod method_score;
pub mod scored_keyframe;
pub mod trackers;
