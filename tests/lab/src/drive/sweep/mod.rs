//! What a sweep runs: a scenario, the parameters that are varied, and the compared methods.

pub mod axis;
pub mod method;
pub mod overrides;
pub mod plan;
pub mod scenarios;
