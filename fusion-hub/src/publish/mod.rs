//! From tracks to fused objects: which tracks are published, and as what.

mod classes;
mod lagged;
mod list;
mod mixture;
mod object;
mod publisher;
mod readings;

pub(crate) use lagged::PastTracks;
pub use list::ObjectList;
pub(crate) use publisher::{PublishConfig, Publisher, TrackList};
pub(crate) use readings::{AgentReading, Readings};
