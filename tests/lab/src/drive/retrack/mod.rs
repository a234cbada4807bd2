//! A recorded hub computed again: its core makes the calls of the journal, and what it publishes is compared with the recording,
//! bit by bit.

mod difference;
mod hub;

use hub::{HubJournal, ListKey};
use std::collections::BTreeMap;
use v2x_common::id::HubId;
use v2x_common::keys::Topic;
use v2x_common::recording::Entry;
use v2x_common::wire::{self, WireError};

pub(crate) use hub::Journalled;

/// Computes the hubs of a recording again.
#[derive(Default)]
pub(crate) struct Retracker {
    hubs: BTreeMap<HubId, HubJournal>,
}

impl Retracker {
    /// Takes the next entry of the recording.
    ///
    /// # Errors
    /// Where a list or a journal cannot be read.
    pub(crate) fn handle(&mut self, entry: &Entry) -> Result<(), WireError> {
        match Topic::of(&entry.key) {
            Some(Topic::Journal(hub)) => {
                let batch = wire::journal::Batch::decode(&entry.payload)?;
                self.hubs.entry(hub).or_default().handle(&batch)
            }
            Some(topic @ (Topic::Fused(hub) | Topic::Lagged(hub))) => {
                let frame = wire::fused::decode(&entry.payload)?;
                let is_lagged = matches!(topic, Topic::Lagged(_));
                let key = ListKey { lineage: frame.lineage, is_lagged, sequence: frame.sequence };
                self.hubs.entry(hub).or_default().note_recorded(key, &entry.payload);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// What came of each hub.
    pub(crate) fn end(self) -> BTreeMap<HubId, Journalled> {
        self.hubs.into_iter().map(|(hub, journal)| (hub, journal.end())).collect()
    }
}

#[cfg(test)]
mod tests;
