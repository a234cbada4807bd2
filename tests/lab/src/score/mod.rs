//! Match → errors → aggregate, and the metrics of the field.

#[cfg(feature = "lab")]
pub(crate) mod bootstrap;
#[cfg(feature = "lab")]
pub(crate) mod continuity;
#[cfg(feature = "lab")]
pub(crate) mod coverage;
pub mod detection;
pub(crate) mod errors;
pub(crate) mod estimate;
#[cfg(test)]
pub(crate) mod fixture;
pub(crate) mod frame_errors;
#[cfg(feature = "lab")]
pub(crate) mod frame_metrics;
pub(crate) mod gospa;
pub(crate) mod keyframes;
pub(crate) mod matching;
pub(crate) mod moments;
#[cfg(feature = "lab")]
pub(crate) mod offline;
#[cfg(feature = "lab")]
pub(crate) mod percentiles;
#[cfg(feature = "lab")]
pub(crate) mod run;
#[cfg(feature = "lab")]
pub(crate) mod sweep;
#[cfg(feature = "lab")]
pub(crate) mod timing;
pub mod tracking;
