//! A recorded run as plain values: all that the consumer received, in order of arrival.

use std::collections::BTreeMap;
use v2x_agent::truth::Identities;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorDescription;
use v2x_common::time::Timestamp;

/// A fused frame as the consumer received it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedFused {
    /// When the consumer received it, by the consumer's clock.
    pub received_at: Timestamp,
    /// The frame.
    pub frame: FusedFrame,
}

/// An agent's detection frame with its simulation truth.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedDetections {
    /// When the consumer received it, by the consumer's clock.
    pub received_at: Timestamp,
    /// The frame.
    pub frame: DetectionFrame,
    /// The true object of each detection.
    pub identities: Identities,
}

/// Everything that the consumer received in one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunLog {
    /// Fused frames in order of arrival.
    pub fused: Vec<ReceivedFused>,
    /// Detection frames in order of arrival.
    pub detections: Vec<ReceivedDetections>,
    /// The newest sensor description of each agent.
    pub descriptions: BTreeMap<AgentId, SensorDescription>,
}
