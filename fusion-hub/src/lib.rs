//! Late fusion of bird's-eye-view detections: the pure engine (association, filter, tracks), and with the
//! feature `net` the hub that serves it.

pub mod association;
pub mod baselines;
mod duplicates;
pub mod engine;
pub mod filter;
pub mod fusion;
#[cfg(feature = "net")]
pub mod hub;
pub mod parameters;
pub mod particles;
mod publish;
pub mod registration;
pub mod track;
mod tracker;
pub mod values;
