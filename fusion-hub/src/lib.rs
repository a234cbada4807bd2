//! Late fusion of bird's-eye-view detections: the pure engine (association, filter, tracks), and with the
//! feature `net` the hub that serves it.
//!
//! Order of the pipeline: [`inbox`] → [`sensing`] → [`association`] → [`track`] and [`filter`] →
//! [`engine`] → [`schedule`].

pub mod assignment;
pub mod association;
pub mod config;
pub mod duplicates;
pub mod engine;
pub mod filter;
#[cfg(feature = "net")]
pub mod hub;
pub mod inbox;
mod publish;
pub mod refusal;
pub mod schedule;
pub mod sensing;
#[cfg(feature = "net")]
pub mod settings;
pub mod track;
