//! The paper's protocol: two agents report keyframe after keyframe to each of the compared methods (METHODS.md 0).

pub mod contender;
pub mod engine_run;
pub mod method;
pub mod outputs;
pub mod setting;
pub mod setup;
