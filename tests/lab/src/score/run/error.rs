//! Why a run cannot be scored.

use v2x_agent::truth::ObjectId;
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;

/// Why a run cannot be scored.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ScoreError {
    /// No agents to compare with.
    #[error("the scenario has no agents")]
    NoAgents,
    /// An agent without a field of view.
    #[error("no sensor description of agent {0} was received")]
    NoDescription(AgentId),
    /// An agent without any detection frame.
    #[error("no detection frame of agent {0} was received")]
    NoDetections(AgentId),
    /// No fused frame after the start of scoring.
    #[error(
        "no fused frame was received after scoring began at {start}, 2 s after every agent's first frame"
    )]
    NoFusedFrames {
        /// When scoring began.
        start: Timestamp,
    },
    /// Detections and simulation truth have different lengths.
    #[error("frame {sequence} of agent {agent} has {detections} detections and {identities} identities")]
    Identities {
        /// The agent.
        agent: AgentId,
        /// The frame's sequence number.
        sequence: u64,
        /// Number of detections.
        detections: usize,
        /// Number of identities.
        identities: usize,
    },
    /// The simulation truth names an object that the world does not have at that time.
    #[error("agent {agent} detected object {} at {at}, where the world has none", object.0)]
    NotInTruth {
        /// The agent.
        agent: AgentId,
        /// The object's identity.
        object: ObjectId,
        /// When it was captured.
        at: Timestamp,
    },
}
