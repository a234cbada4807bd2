//! Match → errors → aggregate, and the metrics of the field.

pub mod bootstrap;
pub mod coverage;
#[cfg(test)]
pub(crate) mod fixture;
pub mod gospa;
pub mod keyframes;
pub mod matching;
pub mod metrics;
pub mod moments;
pub mod offline;
pub mod percentiles;
pub mod run;
pub mod sweep;
pub mod timing;
pub mod tracking;
