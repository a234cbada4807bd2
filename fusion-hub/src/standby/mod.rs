//! Two hubs of one name, of which one publishes: which of them does, and under which ids. Pure: time is an argument.

#[cfg(feature = "net")]
mod beat;
mod names;
mod nearest;
#[cfg(feature = "net")]
mod role;
mod spent;

#[cfg(feature = "net")]
pub(crate) use beat::{Beat, MAX_BEAT_BYTES};
pub(crate) use names::Names;
#[cfg(feature = "net")]
pub(crate) use role::{Heard, Role, lineage_at};
