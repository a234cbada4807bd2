//! A sample as it arrived.

use super::limits::MAX_BYTES;
use v2x_common::clock;
use v2x_common::id::AgentId;
use v2x_common::keys::{self, InvalidAgent};
use v2x_common::time::Timestamp;
use v2x_common::wire::{self, journal::Body};
use zenoh::sample::Sample;

/// A sample as received, with its time of arrival.
#[derive(Debug)]
pub(super) struct Received {
    pub(super) agent: AgentId,
    pub(super) received_at: Timestamp,
    payload: Payload,
}

#[derive(Debug)]
enum Payload {
    /// Copied: a sample of Zenoh, however small, holds the whole buffer of its link while it waits, and each of its fragments one.
    Whole { bytes: Box<[u8]>, is_json: bool },
    /// Larger than allowed, by its size: it is not kept.
    TooLarge(usize),
}

impl Received {
    /// Stamps a sample under an agent's key with the hub's clock; an error where the agent's name is not valid.
    pub(super) fn stamp(sample: &Sample) -> Result<Self, InvalidAgent> {
        let received_at = clock::now();
        let agent = keys::agent_of(sample.key_expr().as_str())?;
        let bytes = sample.payload().len();
        if bytes > MAX_BYTES {
            return Ok(Self { agent, received_at, payload: Payload::TooLarge(bytes) });
        }
        let bytes = sample.payload().to_bytes().into_owned().into_boxed_slice();
        let is_json = wire::is_json(&sample.encoding().to_string(), &bytes);
        Ok(Self { agent, received_at, payload: Payload::Whole { bytes, is_json } })
    }

    /// A payload in postcard that has just arrived.
    #[cfg(test)]
    pub(super) fn of(agent: AgentId, bytes: &[u8]) -> Self {
        let payload = Payload::Whole { bytes: bytes.into(), is_json: false };
        Self { agent, received_at: clock::now(), payload }
    }

    /// The bytes that it keeps.
    pub(super) fn bytes(&self) -> usize {
        match &self.payload {
            Payload::Whole { bytes, .. } => bytes.len(),
            Payload::TooLarge(_) => 0,
        }
    }

    /// Its payload, by its encoding.
    pub(super) fn body(&self) -> Body<'_> {
        match &self.payload {
            Payload::Whole { bytes, is_json: true } => Body::Json(bytes),
            Payload::Whole { bytes, is_json: false } => Body::Postcard(bytes),
            Payload::TooLarge(bytes) => Body::TooLarge(*bytes as u64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::net::session::{self, SessionOptions};

    #[test]
    fn a_flood_of_fragments_makes_a_hub_keep_little_more_than_the_largest_payload_that_it_reads() {
        let config = session::hub_config(&SessionOptions::default()).unwrap();
        let most: usize = config.get_json("transport/link/rx/max_message_size").unwrap().parse().unwrap();
        assert!(most > MAX_BYTES + (1 << 16), "what is too large is counted, with its key: {most}");
        assert!(most <= MAX_BYTES + (1 << 20), "{most}");
    }
}
