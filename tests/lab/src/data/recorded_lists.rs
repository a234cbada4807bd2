//! What a hub published, from any recording: no truth is needed.

use crate::data::run_log::ReceivedFused;
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, HubId};
use v2x_common::keys::Topic;
use v2x_common::recording::{Entry, RecordingError};
use v2x_common::sensor::SensorDescription;
use v2x_common::wire::{self, WireError};

/// Why lists of a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordedListsError {
    /// The recording itself is broken.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A list cannot be read.
    #[error("payload of {key}: {source}")]
    List {
        /// Its key.
        key: String,
        /// The cause.
        source: WireError,
    },
}

/// The lists of one hub.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RecordedLists {
    /// The first hub of the recording.
    pub hub: Option<HubId>,
    /// In the order of arrival.
    pub lists: Vec<ReceivedFused>,
    /// The newest readable sensor description of each agent.
    pub descriptions: BTreeMap<AgentId, SensorDescription>,
}

/// Reads the lists of the first hub that published some.
pub(crate) fn recorded_lists(
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
) -> Result<RecordedLists, RecordedListsError> {
    let mut read = RecordedLists::default();
    for entry in entries {
        let entry = match entry {
            Err(unfinished @ RecordingError::Unfinished { .. }) => {
                tracing::warn!("{unfinished}; what it holds is used");
                break;
            }
            entry => entry?,
        };
        match Topic::of(&entry.key) {
            Some(Topic::Fused(hub)) if *read.hub.get_or_insert(hub) == hub => {
                let frame = wire::fused::decode(&entry.payload)
                    .map_err(|source| RecordedListsError::List { key: entry.key, source })?;
                read.lists.push(ReceivedFused { received_at: entry.received_at, frame });
            }
            Some(Topic::Sensor(agent)) => {
                let description = if wire::is_json(&entry.encoding, &entry.payload) {
                    wire::json::decode_sensor(&entry.payload)
                } else {
                    wire::sensor::decode(&entry.payload)
                };
                // The hub refused it, too, and counted that.
                read.descriptions.extend(description.ok().map(|description| (agent, description)));
            }
            _ => {}
        }
    }
    Ok(read)
}
