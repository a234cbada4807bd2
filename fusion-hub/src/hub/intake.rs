//! From a Zenoh sample to a frame, or to the reason why not.

use crate::engine::Refusal;
use crate::hub::settings::HubSettings;
use v2x_common::clock;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::AgentId;
use v2x_common::keys::{self, InvalidAgent};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::Timestamp;
use v2x_common::unmapped_names::UnmappedNames;
use v2x_common::wire::{self, WireError};
use zenoh::sample::Sample;

/// A sample as received, with its time of arrival.
#[derive(Debug)]
pub(super) struct Received {
    pub(super) agent: AgentId,
    pub(super) received_at: Timestamp,
    sample: Sample,
}

impl Received {
    /// Stamps a sample under an agent's key with the hub's clock; an error where the agent's name is not valid.
    pub(super) fn stamp(sample: Sample) -> Result<Self, InvalidAgent> {
        let received_at = clock::now();
        let agent = keys::agent_of(sample.key_expr().as_str())?;
        Ok(Self { agent, received_at, sample })
    }

    fn is_json(&self, bytes: &[u8]) -> bool {
        wire::is_json(&self.sample.encoding().to_string(), bytes)
    }

    /// The frame with its detections as they were sent, and its unknown class names.
    pub(super) fn frame(&self, settings: &HubSettings) -> Result<(DetectionFrame, UnmappedNames), Refusal> {
        if !settings.listens_to(&self.agent) {
            return Err(Refusal::NotListenedTo);
        }
        let bytes = self.sample.payload().to_bytes();
        let (frame, unmapped_classes) = if self.is_json(&bytes) {
            let defaults = settings.report_defaults_of(&self.agent);
            let decoded = wire::json::decode_detections_as_sent(&bytes, self.agent, defaults)?;
            (decoded.frame, decoded.unmapped_classes)
        } else {
            (wire::detections::decode_as_sent(&bytes)?, UnmappedNames::default())
        };
        if frame.id.agent != self.agent {
            return Err(Refusal::AgentMismatch { payload: frame.id.agent, key: self.agent });
        }
        Ok((frame, unmapped_classes))
    }

    /// The sensor description.
    pub(super) fn description(&self) -> Result<SensorDescription, WireError> {
        let bytes = self.sample.payload().to_bytes();
        if self.is_json(&bytes) { wire::json::decode_sensor(&bytes) } else { wire::sensor::decode(&bytes) }
    }
}
