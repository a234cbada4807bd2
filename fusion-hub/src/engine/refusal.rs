//! Why a frame is not taken.

use v2x_common::id::{AgentId, MapFrame};
use v2x_common::time::Span;
use v2x_common::wire::WireError;

/// Why a frame was refused. Nothing is dropped without one, and every one is counted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The payload is no frame, or holds values that cannot be.
    #[error(transparent)]
    Malformed(#[from] WireError),
    /// The payload names another agent than the key.
    #[error("the payload names agent {payload}, the key names {key}")]
    AgentMismatch {
        /// The agent in the payload.
        payload: AgentId,
        /// The agent in the key.
        key: AgentId,
    },
    /// The positions are in another coordinate frame.
    #[error("map frame {frame} is not this hub's {hub}")]
    MapFrameMismatch {
        /// The frame's.
        frame: MapFrame,
        /// The hub's.
        hub: MapFrame,
    },
    /// Measured longer ago than Δmax by the hub's clock.
    #[error("captured {age} before the hub's time: too late")]
    TooLate {
        /// How long ago.
        age: Span,
    },
    /// Measured before something that is in already, where late data is dropped.
    #[error("captured {behind} before the newest frame: out of sequence, and late data is dropped")]
    OutOfSequence {
        /// How long before.
        behind: Span,
    },
    /// From an agent that the settings exclude.
    #[error("this hub listens to others only (hub.only_agents)")]
    NotListenedTo,
    /// Measured further in the future than Δmax by the hub's clock.
    #[error("captured {ahead} ahead of the hub's time: too early; is the agent's clock set?")]
    TooEarly {
        /// How far ahead.
        ahead: Span,
    },
    /// This agent's frame of this epoch and number was here before.
    #[error("duplicate of frame {sequence} of epoch {epoch}")]
    Duplicate {
        /// The agent's boot epoch.
        epoch: u64,
        /// The frame's number.
        sequence: u64,
    },
    /// Younger than Δmax, but history was shortened for lack of room, or there is none even so.
    #[error("captured {age} before the hub's time: overloaded, history is shorter than the maximum latency")]
    Overloaded {
        /// How long ago.
        age: Span,
    },
    /// More agents than the hub's registry holds.
    #[error("more than {limit} agents")]
    TooManyAgents {
        /// How many are allowed.
        limit: usize,
    },
    /// More detections within Δmax than one agent may send.
    #[error("more than {limit} detections of this agent within the maximum latency")]
    TooManyDetections {
        /// How many are allowed.
        limit: usize,
    },
    /// More frames within Δmax than one agent may send.
    #[error("more than {limit} frames of this agent within the maximum latency")]
    TooManyFrames {
        /// How many are allowed.
        limit: usize,
    },
}

impl Refusal {
    /// A short name for counting, one per cause.
    pub fn reason(&self) -> &'static str {
        match self {
            Self::Malformed(error) => error.reason(),
            Self::AgentMismatch { .. } => "agent_mismatch",
            Self::MapFrameMismatch { .. } => "map_frame_mismatch",
            Self::TooLate { .. } => "too_late",
            Self::OutOfSequence { .. } => "out_of_sequence",
            Self::NotListenedTo => "not_listened_to",
            Self::TooEarly { .. } => "too_early",
            Self::Duplicate { .. } => "duplicate",
            Self::Overloaded { .. } => "overloaded",
            Self::TooManyAgents { .. } => "too_many_agents",
            Self::TooManyDetections { .. } => "too_many_detections",
            Self::TooManyFrames { .. } => "too_many_frames",
        }
    }
}

/// What became of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Disposition {
    /// It is in.
    Accepted {
        /// Whether it was older than something that was in already.
        out_of_sequence: bool,
    },
    /// It is not.
    Refused(Refusal),
}
