//! From a recording to a [`RunLog`].

use crate::data::run_log::{ReceivedDetections, ReceivedFused, RunLog};
use std::collections::BTreeMap;
use v2x_agent::truth::Identities;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::keys::Topic;
use v2x_common::recording::{Entry, RecordingError};
use v2x_common::time::Timestamp;
use v2x_common::wire::json::ReportDefaults;
use v2x_common::wire::{self, WireError};

/// Why a recording cannot be read as a run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RunLogError {
    /// The recording itself is broken.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A payload cannot be read.
    #[error("payload of {key}: {source}")]
    Payload {
        /// The key.
        key: String,
        /// The cause.
        source: WireError,
    },
    /// A side table of simulation truth cannot be read.
    #[error("simulation truth of {key}: {source}")]
    Truth {
        /// Under which key.
        key: String,
        /// What is wrong with it.
        source: serde_json::Error,
    },
}

/// The run of a recording. Detection frames that are unreadable, or have no simulation truth (of foreign agents), are
/// left out: they cannot be scored.
pub(crate) fn run_log(
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
) -> Result<RunLog, RunLogError> {
    let mut log = RunLog::default();
    let mut frames: Vec<(Timestamp, DetectionFrame)> = Vec::new();
    let mut truth: BTreeMap<FrameId, Identities> = BTreeMap::new();
    for entry in entries {
        let entry = match entry {
            Err(unfinished @ RecordingError::Unfinished { .. }) => {
                tracing::warn!("{unfinished}; what it holds is used");
                break;
            }
            entry => entry?,
        };
        let payload = |source| RunLogError::Payload { key: entry.key.clone(), source };
        match Topic::of(&entry.key) {
            Some(Topic::Fused(_)) => {
                let frame = wire::fused::decode(&entry.payload).map_err(payload)?;
                log.fused.push(ReceivedFused { received_at: entry.received_at, frame });
            }
            Some(Topic::Detections(agent)) => match detections(&entry, agent) {
                Ok(frame) => frames.push((entry.received_at, frame)),
                Err(error) => tracing::warn!(key = entry.key, %error, "unreadable frame is not scored"),
            },
            Some(Topic::Sensor(agent)) => {
                let description = if wire::is_json(&entry.encoding, &entry.payload) {
                    wire::json::decode_sensor(&entry.payload)
                } else {
                    wire::sensor::decode(&entry.payload)
                };
                log.descriptions.insert(agent, description.map_err(payload)?);
            }
            Some(Topic::Truth(agent)) => {
                let identities: Identities = serde_json::from_slice(&entry.payload)
                    .map_err(|source| RunLogError::Truth { key: entry.key.clone(), source })?;
                let Identities { epoch, sequence, .. } = identities;
                truth.insert(FrameId { agent, epoch, sequence }, identities);
            }
            Some(
                Topic::AgentAlive(_)
                | Topic::Lagged(_)
                | Topic::Delta(_)
                | Topic::Tile(..)
                | Topic::Journal(_),
            )
            | None => {}
        }
    }
    log.detections = frames
        .into_iter()
        .filter_map(|(received_at, frame)| {
            let identities = truth.remove(&frame.id)?;
            Some(ReceivedDetections { received_at, frame, identities })
        })
        .collect();
    Ok(log)
}

fn detections(entry: &Entry, agent: AgentId) -> Result<DetectionFrame, WireError> {
    if wire::is_json(&entry.encoding, &entry.payload) {
        Ok(wire::json::decode_detections(&entry.payload, agent, &ReportDefaults::default())?.frame)
    } else {
        wire::detections::decode(&entry.payload)
    }
}
