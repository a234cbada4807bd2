//! From tracks to fused objects: which tracks are published, and as what.

mod lagged;
mod list;
mod mixture;
mod object;
mod publisher;

pub(crate) use lagged::PastTracks;
pub use list::ObjectList;
pub(crate) use publisher::{PublishConfig, Publisher, Readings, TrackList};
