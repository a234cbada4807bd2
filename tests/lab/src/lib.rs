//! The laboratory: running ([`loopback`]), recording ([`consumer`], [`recorded`]), scoring and reporting
//! cooperative-perception networks.
//!
//! Scoring reads as a pipeline of pure functions: a run's [`run_log`] and the [`truth`] → what agents
//! can know ([`coverage`]) → [`matching`] → [`metrics`] → [`summary`] → [`report`] and [`plot`].
//!
//! The paper's evaluation is another one: a [`dataset`] → the [`protocol`] → [`tables`]; what others make of its
//! detections goes out by [`mod@export`] and comes in as a [`guest`]. Their own detections go through
//! [`fuse`]. Metrics of [`tracking`] take the output of either.
//!
//! For the tests of another project `default-features = false, features = ["loopback"]` is enough: [`loopback`],
//! [`consumer`] and [`hub_status`], without what only the laboratory needs (the feature `lab`).

#[cfg(feature = "lab")]
mod bootstrap;
#[cfg(feature = "loopback")]
pub mod consumer;
#[cfg(feature = "lab")]
pub mod coverage;
#[cfg(feature = "lab")]
pub mod csv_table;
#[cfg(feature = "lab")]
pub mod dataset;
#[cfg(feature = "lab")]
pub mod export;
#[cfg(feature = "lab")]
pub mod fuse;
#[cfg(feature = "lab")]
pub mod gospa;
#[cfg(feature = "lab")]
pub mod guest;
#[cfg(feature = "loopback")]
pub mod hub_status;
#[cfg(feature = "loopback")]
pub mod loopback;
#[cfg(feature = "lab")]
pub mod matching;
#[cfg(feature = "lab")]
pub mod metrics;
#[cfg(feature = "lab")]
pub mod percentiles;
#[cfg(feature = "lab")]
pub mod plot;
#[cfg(feature = "lab")]
pub mod protocol;
#[cfg(feature = "lab")]
pub mod recorded;
#[cfg(feature = "lab")]
pub mod report;
#[cfg(feature = "lab")]
pub mod run_folder;
#[cfg(feature = "lab")]
pub mod run_log;
#[cfg(feature = "lab")]
pub mod score;
#[cfg(feature = "lab")]
pub mod seconds;
#[cfg(feature = "lab")]
pub mod simulate;
#[cfg(feature = "lab")]
pub mod simulation;
#[cfg(feature = "lab")]
pub mod summary;
#[cfg(feature = "lab")]
pub mod sweep;
#[cfg(feature = "lab")]
pub mod tables;
#[cfg(feature = "lab")]
pub mod throughput;
#[cfg(feature = "lab")]
pub mod timing;
#[cfg(feature = "lab")]
pub mod tracking;
#[cfg(feature = "lab")]
pub mod traffic;
#[cfg(feature = "lab")]
pub mod truth;
#[cfg(feature = "lab")]
pub mod virtual_run;

#[cfg(test)]
#[cfg(feature = "lab")]
mod fixture;
