//! The laboratory: recording, scoring and reporting cooperative-perception networks.
//!
//! Scoring reads as a pipeline of pure functions: a run's [`run_log`] and the [`truth`] → what agents
//! can know ([`coverage`]) → [`matching`] → [`metrics`] → [`summary`] → [`report`] and [`plot`].

pub mod coverage;
pub mod gospa;
pub mod matching;
pub mod metrics;
pub mod percentiles;
pub mod plot;
pub mod report;
pub mod run_log;
pub mod score;
pub mod summary;
pub mod timing;
pub mod truth;

#[cfg(test)]
mod fixture;
