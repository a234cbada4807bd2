//! How methods do over keyframes: the paper's errors, and tracking metrics, of many scenes and trials.

pub mod counting;
pub mod experiments;
pub mod instant;
pub mod method_score;
pub mod trackers;
