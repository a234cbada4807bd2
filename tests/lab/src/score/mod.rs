//! Match → errors → aggregate, and the metrics of the field.

pub mod bootstrap;
pub mod continuity;
pub mod coverage;
pub mod errors;
pub mod estimate;
#[cfg(test)]
pub(crate) mod fixture;
pub mod frame_errors;
pub mod frame_metrics;
pub mod gospa;
pub mod keyframes;
pub mod matching;
pub mod moments;
pub mod offline;
pub mod percentiles;
pub mod run;
pub mod sweep;
pub mod timing;
pub mod tracking;
