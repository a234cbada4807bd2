//! Which hubs are to be asked for a start of their journal: those whose lists come without it, or with a gap.

use std::collections::BTreeMap;
use v2x_common::id::HubId;
use v2x_common::keys::Topic;
use v2x_common::recording::Entry;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::journal::Batch;

/// A hub whose lists come for so long without its journal is asked for it.
const SILENT_FOR: Span = Span::from_millis(1000);
/// A hub is asked this often at most, and half as often after each time that brought no start.
const ASKED_EVERY: Span = Span::from_millis(1000);
const MOST_HALVINGS: u32 = 6;

/// What is known of the journals of all hubs.
#[derive(Debug, Default)]
pub(super) struct Journals {
    hubs: BTreeMap<HubId, Journal>,
}

#[derive(Debug)]
struct Journal {
    /// Lineage of the hub, and the number of its next item.
    next: Option<(u32, u64)>,
    heard_at: Timestamp,
    asked_at: Timestamp,
    /// How often it was asked since its last start.
    n_asked: u32,
    is_broken: bool,
}

impl Default for Journal {
    fn default() -> Self {
        Self { next: None, heard_at: Timestamp::MIN, asked_at: Timestamp::MIN, n_asked: 0, is_broken: false }
    }
}

impl Journal {
    /// How long after it was asked it is asked again.
    const fn patience(&self) -> Span {
        let halvings = if self.n_asked > MOST_HALVINGS { MOST_HALVINGS } else { self.n_asked };
        Span::from_nanos(ASKED_EVERY.as_nanos() << halvings >> 1)
    }
}

impl Journals {
    /// Notes a sample.
    pub(super) fn note(&mut self, entry: &Entry) {
        match Topic::of(&entry.key) {
            Some(Topic::Fused(hub)) => {
                self.hubs.entry(hub).or_default();
            }
            Some(Topic::Journal(hub)) => {
                let journal = self.hubs.entry(hub).or_default();
                journal.heard_at = entry.received_at;
                let Ok(batch) = Batch::decode(&entry.payload) else {
                    journal.is_broken = true;
                    return;
                };
                let is_gap = journal.next.is_some_and(|next| next != (batch.lineage, batch.first));
                let has_start =
                    batch.items().any(|item| matches!(item, Ok(v2x_common::wire::journal::Item::Start(_))));
                if has_start {
                    journal.n_asked = 0;
                }
                journal.is_broken = (journal.is_broken || is_gap) && !has_start;
                journal.next = Some((batch.lineage, batch.first + batch.items().count() as u64));
            }
            _ => {}
        }
    }

    /// A further file begins: it needs a start of its own.
    pub(super) fn renew(&mut self) {
        for journal in self.hubs.values_mut() {
            journal.is_broken = true;
            journal.asked_at = Timestamp::MIN;
            journal.n_asked = 0;
        }
    }

    /// The hubs that are to be asked now.
    pub(super) fn take_due(&mut self, now: Timestamp) -> Vec<HubId> {
        let is_due = |journal: &Journal| {
            (journal.is_broken || now - journal.heard_at > SILENT_FOR)
                && now - journal.asked_at > journal.patience()
        };
        let due: Vec<_> =
            self.hubs.iter().filter(|(_, journal)| is_due(journal)).map(|(hub, _)| *hub).collect();
        for hub in &due {
            let journal = self.hubs.entry(*hub).or_default();
            journal.asked_at = now;
            journal.n_asked += 1;
        }
        due
    }

    /// Whether every hub's journal comes without a gap.
    pub(super) fn are_whole(&self) -> bool {
        !self.hubs.is_empty()
            && self.hubs.values().all(|journal| journal.next.is_some() && !journal.is_broken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::NetworkId;
    use v2x_common::keys::Keys;
    use v2x_common::wire::journal::{self, Call, Item, Start};

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    fn entry(ms: i64, key: String, payload: Vec<u8>) -> Entry {
        Entry { received_at: at(ms), key, encoding: String::new(), payload }
    }

    fn batch(ms: i64, first: u64, items: &[Item<'_>]) -> Entry {
        let mut payload = Vec::new();
        journal::begin(1, first, &mut payload).unwrap();
        items.iter().for_each(|item| journal::push(item, &mut payload).unwrap());
        entry(ms, keys().journal(&hub()), payload)
    }

    fn keys() -> Keys {
        Keys::new(NetworkId::new("demo").unwrap())
    }

    fn hub() -> HubId {
        HubId::new("hub").unwrap()
    }

    const START: Item<'_> =
        Item::Start(Start { settings: "", version: "", commit: "", state: None, not_repeatable: None });
    const CALL: Item<'_> = Item::Call(Call::Fused { now: Timestamp::EPOCH });

    #[test]
    fn a_hub_is_asked_when_its_first_list_comes_and_not_again_while_its_journal_does() {
        let mut journals = Journals::default();
        assert!(journals.take_due(at(0)).is_empty());
        journals.note(&entry(10, keys().fused(&hub()), Vec::new()));
        assert_eq!(journals.take_due(at(10)), [hub()]);
        assert!(journals.take_due(at(200)).is_empty(), "it has been asked");
        journals.note(&batch(300, 0, &[START, CALL]));
        journals.note(&batch(1900, 2, &[CALL]));
        assert!(journals.take_due(at(2000)).is_empty() && journals.are_whole());
        assert_eq!(journals.take_due(at(4000)), [hub()], "no batch for long");
    }

    #[test]
    fn a_hub_that_gives_no_start_is_asked_ever_more_rarely() {
        let mut journals = Journals::default();
        journals.note(&entry(0, keys().fused(&hub()), Vec::new()));
        let asked = (0..60_000).step_by(100).filter(|ms| !journals.take_due(at(*ms)).is_empty()).count();
        assert!((5..=8).contains(&asked), "{asked} times in a minute");
        journals.note(&batch(60_000, 0, &[START, CALL]));
        assert_eq!(journals.take_due(at(62_000)), [hub()], "soon after a start");
    }

    #[test]
    fn a_gap_and_a_restart_and_a_further_file_ask_for_a_start() {
        let mut journals = Journals::default();
        journals.note(&batch(0, 0, &[START, CALL]));
        journals.note(&batch(10, 3, &[CALL]));
        assert!(!journals.are_whole());
        assert_eq!(journals.take_due(at(20)), [hub()]);
        journals.note(&batch(30, 4, &[CALL, START, CALL]));
        assert!(journals.are_whole() && journals.take_due(at(1000)).is_empty());
        journals.renew();
        assert_eq!(journals.take_due(at(1020)), [hub()]);
    }
}
