//! What a recorded hub was given, so that another one can be given the same.

use v2x_common::id::{AgentId, HubId};
use v2x_common::keys::Topic;
use v2x_common::recording::{Entry, RecordingError};
use v2x_common::time::Timestamp;
use v2x_common::wire;
use v2x_common::wire::journal::{Batch, Body, Call, Item};
use v2x_fusion_hub::hub::HubSettings;

/// A payload that a hub was given.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HubInput {
    /// When it arrived: by the hub's clock where its journal says so, else by the recorder's.
    pub at: Timestamp,
    /// The agent of its key.
    pub agent: AgentId,
    /// Whether it is a sensor description, and no frame.
    pub is_description: bool,
    is_json: bool,
    payload: Vec<u8>,
}

impl HubInput {
    /// A frame in JSON.
    pub(crate) const fn frame(at: Timestamp, agent: AgentId, json: Vec<u8>) -> Self {
        Self { at, agent, is_description: false, is_json: true, payload: json }
    }

    /// A sensor description in JSON.
    pub(crate) const fn description(at: Timestamp, agent: AgentId, json: Vec<u8>) -> Self {
        Self { at, agent, is_description: true, is_json: true, payload: json }
    }

    /// The payload.
    pub(crate) fn body(&self) -> Body<'_> {
        if self.is_json { Body::Json(&self.payload) } else { Body::Postcard(&self.payload) }
    }
}

/// All that the first hub of a recording was given.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct HubInputs {
    /// Its settings, where there is a journal.
    pub settings: Option<HubSettings>,
    /// In the order of arrival.
    pub inputs: Vec<HubInput>,
}

/// Reads what the hub was given: by its journal as far as there is one, before by the samples themselves.
pub(crate) fn hub_inputs(
    entries: impl IntoIterator<Item = Result<Entry, RecordingError>>,
) -> Result<HubInputs, RecordingError> {
    let mut reader = Reader::default();
    for entry in entries {
        match entry {
            Err(RecordingError::Unfinished { .. }) => break,
            entry => reader.take(&entry?),
        }
    }
    Ok(reader.end())
}

#[derive(Default)]
struct Reader {
    hub: Option<HubId>,
    settings: Option<HubSettings>,
    seen: Vec<HubInput>,
    journalled: Vec<HubInput>,
    /// Time of the newest frame of the journal: its descriptions have none of their own.
    at: Timestamp,
}

impl Reader {
    fn take(&mut self, entry: &Entry) {
        let is_json = wire::is_json(&entry.encoding, &entry.payload);
        match Topic::of(&entry.key) {
            Some(topic @ (Topic::Detections(agent) | Topic::Sensor(agent))) => self.seen.push(HubInput {
                at: entry.received_at,
                agent,
                is_description: matches!(topic, Topic::Sensor(_)),
                is_json,
                payload: entry.payload.clone(),
            }),
            Some(Topic::Journal(hub)) if *self.hub.get_or_insert(hub) == hub => {
                // What cannot be read of a journal is no input.
                let Ok(batch) = Batch::decode(&entry.payload) else { return };
                batch.items().map_while(Result::ok).for_each(|item| self.take_item(&item, entry.received_at));
            }
            _ => {}
        }
    }

    fn take_item(&mut self, item: &Item<'_>, recorded_at: Timestamp) {
        let (at, agent, body, is_description) = match *item {
            Item::Start(start) => {
                if self.settings.is_none() {
                    self.settings = serde_json::from_str(start.settings).ok();
                }
                return;
            }
            Item::Call(Call::Frame { agent, received_at, body }) => (received_at, agent, body, false),
            Item::Call(Call::Description { agent, body }) => {
                (if self.at > Timestamp::EPOCH { self.at } else { recorded_at }, agent, body, true)
            }
            Item::Call(_) => return,
        };
        self.at = at;
        let (is_json, payload) = match body {
            Body::Json(payload) => (true, payload),
            Body::Postcard(payload) => (false, payload),
            Body::TooLarge(_) => return,
        };
        let payload = payload.to_vec();
        self.journalled.push(HubInput { at, agent, is_description, is_json, payload });
    }

    fn end(self) -> HubInputs {
        let begins_at = self.journalled.iter().find(|input| !input.is_description).map(|input| input.at);
        let is_before = |input: &HubInput| begins_at.is_none_or(|begins_at| input.at < begins_at);
        let mut inputs: Vec<_> = self.seen.into_iter().filter(is_before).collect();
        inputs.extend(self.journalled);
        HubInputs { settings: self.settings, inputs }
    }
}
