//! What the laboratory works on: readers of data sets, tables and recordings, and generators of scenes, noise and detections.

pub mod conditions;
pub mod csv_table;
pub mod dataset;
pub mod detection_log;
pub mod exported;
#[cfg(test)]
pub(crate) mod fixture;
pub mod fused_box;
pub mod method_output;
pub mod noise;
pub mod observation;

pub mod recording;
pub mod run_log;
pub mod scene;
pub mod seconds;
pub mod simulation;
#[cfg(test)]
pub(crate) mod test_scenes;
pub mod truth;
pub mod truth_table;
pub mod workload;
