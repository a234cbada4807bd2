//! One hub of a recording, computed again.

use super::difference::Difference;
use std::collections::BTreeMap;
use v2x_common::wire::WireError;
use v2x_common::wire::journal::{Batch, Call, Item, Start};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::{Core, HubSettings, encode_list};

/// Lists that wait for their twin: of a list that was not recorded it never comes.
const MAX_WAITING: usize = 4096;

/// Which list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ListKey {
    pub(super) lineage: u32,
    pub(super) is_lagged: bool,
    pub(super) sequence: u64,
}

/// What came of a hub.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Journalled {
    /// Lists that were computed again and are as recorded, bit by bit.
    pub(crate) identical: u64,
    /// The first of those that are not.
    pub(crate) different: Option<Difference>,
    /// Lists that were computed again and are in the recording not at all.
    pub(crate) not_recorded: u64,
    /// Recorded lists that no journal leads to: from before it started, or within a gap.
    pub(crate) not_journalled: u64,
    /// Calls that were made again.
    pub(crate) calls: u64,
    /// Whether there is a journal at all.
    pub(crate) has_journal: bool,
    /// Batches of the journal that are missing.
    pub(crate) gaps: u64,
    /// Version and commit of the hub.
    pub(crate) build: Option<(String, String)>,
    /// Why nothing could be computed, where a start could not be used.
    pub(crate) unusable: Option<String>,
}

/// The journal of a hub as far as it was read.
#[derive(Default)]
pub(super) struct HubJournal {
    core: Option<Core>,
    lineage: u32,
    /// The number of the next item.
    next: Option<u64>,
    buffer: Vec<u8>,
    /// Lists of one side that wait for the other.
    computed: BTreeMap<ListKey, Vec<u8>>,
    recorded: BTreeMap<ListKey, Vec<u8>>,
    found: Journalled,
}

impl HubJournal {
    pub(super) fn handle(&mut self, batch: &Batch<'_>) -> Result<(), WireError> {
        self.found.has_journal = true;
        let is_other = batch.lineage != self.lineage;
        if is_other || self.next.is_some_and(|next| next != batch.first) {
            self.found.gaps += u64::from(!is_other);
            self.core = None;
            self.lineage = batch.lineage;
        }
        self.next = Some(batch.first);
        for item in batch.items() {
            match item? {
                Item::Start(start) => self.start(&start),
                Item::Call(call) => self.repeat(&call),
            }
            self.next = self.next.map(|next| next + 1);
        }
        Ok(())
    }

    /// A further start changes nothing where the calls since an earlier one are all there.
    fn start(&mut self, start: &Start<'_>) {
        self.found.build = Some((start.version.to_owned(), start.commit.to_owned()));
        if self.core.is_some() {
            return;
        }
        match core_of(start) {
            Ok(core) => self.core = Some(core),
            Err(why) => self.found.unusable = Some(why),
        }
    }

    fn repeat(&mut self, call: &Call<'_>) {
        let Some(core) = &mut self.core else { return };
        self.found.calls += 1;
        let is_lagged = matches!(call, Call::Lagged { .. });
        let Some(list) = core.repeat(call) else { return };
        let key = ListKey { lineage: list.lineage, is_lagged, sequence: list.sequence };
        // What cannot be encoded was not published.
        if encode_list(list, &mut self.buffer).is_err() {
            return;
        }
        match self.recorded.remove(&key) {
            Some(recorded) => compare(&mut self.found, &recorded, &self.buffer),
            None => {
                self.computed.insert(key, self.buffer.clone());
                self.found.not_recorded += bounded(&mut self.computed);
            }
        }
    }

    pub(super) fn note_recorded(&mut self, key: ListKey, payload: &[u8]) {
        match self.computed.remove(&key) {
            Some(computed) => compare(&mut self.found, payload, &computed),
            None => {
                self.recorded.insert(key, payload.to_vec());
                self.found.not_journalled += bounded(&mut self.recorded);
            }
        }
    }

    pub(super) fn end(mut self) -> Journalled {
        self.found.not_recorded += self.computed.len() as u64;
        self.found.not_journalled += self.recorded.len() as u64;
        self.found
    }
}

/// Forgets the oldest where there are too many; how many.
fn bounded(waiting: &mut BTreeMap<ListKey, Vec<u8>>) -> u64 {
    u64::from(waiting.len() > MAX_WAITING && waiting.pop_first().is_some())
}

fn compare(found: &mut Journalled, recorded: &[u8], computed: &[u8]) {
    if recorded == computed {
        found.identical += 1;
    } else if found.different.is_none() {
        found.different = Some(Difference::of(recorded, computed));
    }
}

/// The core from which a journal goes on, or why there is none.
fn core_of(start: &Start<'_>) -> Result<Core, String> {
    if let Some(why) = start.not_repeatable {
        return Err(why.to_owned());
    }
    let settings: HubSettings =
        serde_json::from_str(start.settings).map_err(|error| format!("the hub's settings: {error}"))?;
    match start.state {
        None => Ok(Core::new(settings, Engine::new)),
        Some(state) => Core::restored(settings, state).map_err(|error| error.to_string()),
    }
}
