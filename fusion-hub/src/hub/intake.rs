//! A sample as it arrived.

use super::limits::MAX_BYTES;
use std::borrow::Cow;
use v2x_common::clock;
use v2x_common::id::AgentId;
use v2x_common::keys::{self, InvalidAgent};
use v2x_common::time::Timestamp;
use v2x_common::wire::journal::Body;
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

    /// Its payload in one piece.
    pub(super) fn contents(&self) -> Cow<'_, [u8]> {
        match &self.payload {
            Payload::Whole(sample) => sample.payload().to_bytes(),
            Payload::TooLarge(_) => Cow::Borrowed(&[]),
        }
    }

    /// Its payload, by its encoding; `contents` are [`Self::contents`].
    pub(super) fn body<'a>(&self, contents: &'a [u8]) -> Body<'a> {
        match &self.payload {
            Payload::Whole(sample) => Body::of(&sample.encoding().to_string(), contents),
            Payload::TooLarge(bytes) => Body::TooLarge(*bytes as u64),
        }
    }
}
