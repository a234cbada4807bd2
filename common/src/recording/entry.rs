//! What a recording holds.

use crate::time::Timestamp;
use std::io;

/// One received sample.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// When the recorder received it.
    pub received_at: Timestamp,
    /// Its key.
    pub key: String,
    /// The Zenoh encoding.
    pub encoding: String,
    /// The payload.
    pub payload: Vec<u8>,
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read at all.
    #[error("reading the recording: {0}")]
    Io(#[from] io::Error),
    /// It is neither an MCAP file nor one of the format before.
    #[error("not a recording: it begins neither as an MCAP file nor with V2XREC1")]
    NotARecording,
    /// A part of it is broken; what stands before it is complete.
    #[error("the recording is broken after {index} entries: {why}")]
    Broken {
        /// Entries before it.
        index: usize,
        /// The cause.
        why: String,
    },
    /// It was not ended: its recorder was killed, or the disk was full. What was read is complete.
    #[error(
        "the recording ends after {index} entries without an end: its recorder was killed or had no room"
    )]
    Unfinished {
        /// Entries before the end.
        index: usize,
    },
}
