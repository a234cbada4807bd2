//! The laboratory's data: readers of data sets, tables and recordings; generators of scenes, noise and detections.

pub(crate) mod conditions;
pub(crate) mod csv_table;
pub(crate) mod dataset;
pub(crate) mod detection_log;
pub(crate) mod exported;
#[cfg(test)]
pub(crate) mod fixture;
pub(crate) mod fused_box;
pub(crate) mod hub_inputs;
pub(crate) mod method_output;
pub(crate) mod noise;
pub(crate) mod observation;

pub(crate) mod recording;
pub(crate) mod run_log;
pub(crate) mod scene;
pub(crate) mod seconds;
pub(crate) mod simulation;
#[cfg(test)]
pub(crate) mod test_scenes;
pub(crate) mod truth;
pub(crate) mod truth_table;
pub mod workload;
