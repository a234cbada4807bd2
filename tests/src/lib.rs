//! The laboratory: running ([`loopback`]), recording ([`consumer`], [`recorded`]), scoring and reporting
//! cooperative-perception networks.
//!
//! Scoring reads as a pipeline of pure functions: a run's [`run_log`] and the [`truth`] → what agents
//! can know ([`coverage`]) → [`matching`] → [`metrics`] → [`summary`] → [`report`] and [`plot`].
//!
//! The paper's evaluation is another one: a [`dataset`] → the [`protocol`] → [`tables`]; what others make of its
//! detections goes out by [`mod@export`] and comes in as a [`guest`]. Their own detections go through
//! [`fuse`]. Metrics of [`tracking`] take the output of either.

mod bootstrap;
pub mod consumer;
pub mod coverage;
pub mod csv_table;
pub mod dataset;
pub mod export;
pub mod fuse;
pub mod gospa;
pub mod guest;
pub mod hub_status;
pub mod loopback;
pub mod matching;
pub mod metrics;
pub mod percentiles;
pub mod plot;
pub mod protocol;
pub mod recorded;
pub mod report;
pub mod run_folder;
pub mod run_log;
pub mod score;
pub mod seconds;
pub mod simulate;
pub mod simulation;
pub mod summary;
pub mod sweep;
pub mod tables;
pub mod throughput;
pub mod timing;
pub mod tracking;
pub mod traffic;
pub mod truth;
pub mod virtual_run;

#[cfg(test)]
mod fixture;
