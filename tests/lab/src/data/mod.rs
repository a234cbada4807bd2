//! The laboratory's data: readers of data sets, tables and recordings; generators of scenes, noise and detections.

pub(crate) mod conditions;
pub(crate) mod csv_table;
pub(crate) mod dataset;
pub(crate) mod detection_columns;
#[cfg(feature = "lab")]
pub(crate) mod detection_log;
pub(crate) mod exported;
#[cfg(test)]
pub(crate) mod fixture;
pub(crate) mod fused_box;
#[cfg(feature = "lab")]
pub(crate) mod hub_inputs;
#[cfg(feature = "lab")]
pub(crate) mod method_output;
pub(crate) mod noise;
pub(crate) mod observation;
#[cfg(feature = "lab")]
pub(crate) mod recorded_lists;
#[cfg(feature = "lab")]
pub(crate) mod recording;
#[cfg(feature = "lab")]
pub(crate) mod run_log;
pub(crate) mod scene;
pub(crate) mod seconds;
#[cfg(feature = "lab")]
pub(crate) mod simulation;
#[cfg(test)]
pub(crate) mod test_scenes;
#[cfg(feature = "lab")]
pub(crate) mod truth;
#[cfg(feature = "lab")]
pub(crate) mod truth_table;
#[cfg(feature = "lab")]
pub mod workload;
