//! Late fusion of bird's-eye-view detections: the pure engine (association, filter, tracks), and with the
//! feature `net` the hub that serves it.
//!
//! Order of the pipeline: [`inbox`] → [`sensing`] → [`association`] → [`track`] and [`filter`] →
//! [`engine`].

pub mod assignment;
pub mod association;
pub mod config;
pub mod engine;
pub mod filter;
pub mod inbox;
pub mod refusal;
pub mod sensing;
pub mod track;
