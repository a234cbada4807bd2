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
use v2x_common::wire;
use zenoh::sample::Sample;

/// A sample as received, with its time of arrival.
#[derive(Debug)]
pub(super) struct Received {
    pub(super) agent: AgentId,
    pub(super) received_at: Timestamp,
    payload: Payload,
}

/// Largest payload that is read: 4096 detections as verbose JSON.
const MAX_BYTES: usize = 4 << 20;

#[derive(Debug)]
enum Payload {
    Whole(Box<Sample>),
    /// Larger than allowed, by its size: it is not kept.
    TooLarge(usize),
}

impl Received {
    /// Stamps a sample under an agent's key with the hub's clock; an error where the agent's name is not valid.
    pub(super) fn stamp(sample: Sample) -> Result<Self, InvalidAgent> {
        let received_at = clock::now();
        let agent = keys::agent_of(sample.key_expr().as_str())?;
        let bytes = sample.payload().len();
        let payload =
            if bytes > MAX_BYTES { Payload::TooLarge(bytes) } else { Payload::Whole(Box::new(sample)) };
        Ok(Self { agent, received_at, payload })
    }

    /// The bytes that it keeps.
    pub(super) fn bytes(&self) -> usize {
        match &self.payload {
            Payload::Whole(sample) => sample.payload().len(),
            Payload::TooLarge(_) => 0,
        }
    }

    fn sample(&self) -> Result<&Sample, Refusal> {
        match &self.payload {
            Payload::Whole(sample) => Ok(sample),
            Payload::TooLarge(bytes) => Err(Refusal::TooLarge { bytes: *bytes, limit: MAX_BYTES }),
        }
    }

    /// The frame with its detections as they were sent, and its unknown class names.
    pub(super) fn frame(&self, settings: &HubSettings) -> Result<(DetectionFrame, UnmappedNames), Refusal> {
        if !settings.listens_to(&self.agent) {
            return Err(Refusal::NotListenedTo);
        }
        let sample = self.sample()?;
        let bytes = sample.payload().to_bytes();
        let (frame, unmapped_classes) = if is_json(sample, &bytes) {
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
    pub(super) fn description(&self) -> Result<SensorDescription, Refusal> {
        let sample = self.sample()?;
        let bytes = sample.payload().to_bytes();
        let decode = if is_json(sample, &bytes) { wire::json::decode_sensor } else { wire::sensor::decode };
        Ok(decode(&bytes)?)
    }
}

fn is_json(sample: &Sample, bytes: &[u8]) -> bool {
    wire::is_json(&sample.encoding().to_string(), bytes)
}
