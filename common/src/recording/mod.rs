//! Recordings: the samples that one process received, in their order, with the payloads of the wire.
//!
//! A recording is an MCAP file with a channel for each key (feature `mcap`). Files of the format before (`V2XREC1`) are read,
//! too.

mod entry;
#[cfg(feature = "mcap")]
mod file;
#[cfg(feature = "mcap")]
mod legacy;
#[cfg(feature = "mcap")]
mod mcap_reader;
#[cfg(feature = "mcap")]
mod mcap_writer;
#[cfg(feature = "mcap")]
mod open;
#[cfg(feature = "mcap")]
mod scene;

pub use entry::{Entry, RecordingError};
#[cfg(feature = "mcap")]
pub use file::{FileError, RecordingFile, RecordingOptions};
#[cfg(feature = "mcap")]
pub use open::Recording;
#[cfg(feature = "mcap")]
pub use scene::{SCENE_SCHEMA, SCENE_SCHEMA_NAME, SCENE_SUFFIX, Scene, Scenes};
