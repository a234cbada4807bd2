//! Late fusion of bird's-eye-view detections: the pure engine (association, filter, tracks), and with the
//! feature `net` the hub that serves it.
//!
//! Order of the pipeline: [`engine`] → [`inbox`] → [`sensing`] → [`frames`] → [`association`] → [`track`] and
//! [`filter`] → [`schedule`].

pub mod agents;
pub mod assignment;
pub mod association;
pub mod baselines;
pub mod config;
pub mod duplicates;
pub mod engine;
mod exponential;
pub mod filter;
pub mod frames;
#[cfg(feature = "net")]
pub mod hub;
pub mod inbox;
pub mod method;
pub mod overlap;
pub mod parameters;
pub mod particles;
mod publish;
pub mod refusal;
pub mod registration;
pub mod retrospect;
pub mod schedule;
pub mod sensing;
#[cfg(feature = "net")]
pub mod settings;
pub mod track;
mod tracker;

pub use tracker::Counts;
