//! What a sweep runs: a scenario, the parameters that are varied, and the compared methods.

pub(crate) mod axis;
pub(crate) mod method;
pub(crate) mod overrides;
pub(crate) mod plan;
pub(crate) mod scenarios;
