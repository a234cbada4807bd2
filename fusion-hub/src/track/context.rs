//! What the evidence of tracks refers to, and the rules by which it is read.

use super::frame_store::FrameStore;
use crate::values::AgentNames;
use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// Evidence can stay this much longer than the horizon. It is then folded at a checkpoint, without a replay.
pub const FOLD_SLACK: Span = Span::from_millis(125);

/// From when on history is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Horizon {
    /// Nothing that was captured earlier can still arrive.
    pub at: Timestamp,
    /// Evidence may be held for so much longer, to be folded at a checkpoint (at most [`FOLD_SLACK`]).
    pub slack: Span,
}

/// What becomes of newer measurements when an out-of-sequence measurement is applied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Rollback {
    /// They are applied again after it.
    #[default]
    Replay,
    /// They are lost, as in the paper's text read literally.
    Only,
}

/// What the evidence of tracks refers to, and the rules by which it is read.
#[derive(Clone, Copy, Debug)]
pub struct TrackContext<'a> {
    /// Measurements and coverages.
    pub frames: &'a FrameStore,
    /// Names of the agents.
    pub agents: &'a AgentNames,
    /// ε_s: a measurement this near to the state's own time is taken as simultaneous.
    pub synchronous: Span,
    /// What becomes of measurements newer than a late one.
    pub rollback: Rollback,
    /// Whether tracks keep the contributors of folded evidence: with a lag, what is published may be older than it.
    pub keeps_folded: bool,
    /// Whether the class of a track selects its motion parameters.
    pub class_motion: bool,
    /// Whether two bodies cannot be at one place.
    pub exclusion: bool,
}
