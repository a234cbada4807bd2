//! Versions of tracks, and what becomes of them in a frame.

use crate::values::ParticleSet;
use v2x_common::id::TrackId;
use v2x_common::time::Timestamp;

/// A version of a track that the frame can concern.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Version {
    /// The track.
    pub(crate) track: TrackId,
    /// The particles that hold it.
    pub(crate) holders: ParticleSet,
    /// Time of the last change of hypotheses of the track.
    pub(crate) disputed_at: Timestamp,
}

/// Particles that hold a version, and the report that they assign to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outcome {
    /// The version's place among those expected.
    pub(crate) col: u32,
    /// Its report in the frame.
    pub(crate) report: Option<u16>,
    /// The particles that hold it after the frame.
    pub(crate) holders: ParticleSet,
    /// Time of the last change of hypotheses of the track.
    pub(crate) disputed_at: Timestamp,
}
