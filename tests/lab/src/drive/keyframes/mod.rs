//! The paper's protocol: two agents report keyframe after keyframe to each of the compared methods (deploy/docs/methods.md).

pub(crate) mod contender;
pub(crate) mod engine_run;
pub(crate) mod method;
pub(crate) mod outputs;
pub(crate) mod setting;
pub(crate) mod setup;
