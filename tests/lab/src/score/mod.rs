//! Match → errors → aggregate, and the metrics of the field.

pub(crate) mod bootstrap;
pub(crate) mod continuity;
pub(crate) mod coverage;
pub mod detection;
pub(crate) mod errors;
pub(crate) mod estimate;
#[cfg(test)]
pub(crate) mod fixture;
pub(crate) mod frame_errors;
pub(crate) mod frame_metrics;
pub(crate) mod gospa;
pub(crate) mod keyframes;
pub(crate) mod matching;
pub(crate) mod moments;
pub(crate) mod offline;
pub(crate) mod percentiles;
pub(crate) mod run;
pub(crate) mod sweep;
pub(crate) mod timing;
pub mod tracking;
