//! What a hub finds wrong with its agents over the time of a recording.

use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::diagnosis::{Code, Finding, Tokens};
use v2x_fusion_hub::hub::Core;

/// The live hub judges its agents as often.
const EVERY: Span = Span::from_millis(1000);

/// What it finds is of a window as long as this.
const WINDOW: Span = Span::from_millis(10_000);

/// One thing that is probably wrong, and when it was seen.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Found {
    /// As it was said last.
    pub finding: Finding,
    /// When it was seen first.
    pub first: Timestamp,
    /// When it was seen last.
    pub last: Timestamp,
}

/// The findings of a core that is asked once a second.
#[derive(Debug)]
pub(super) struct FoundOverTime {
    next: Timestamp,
    found: BTreeMap<(Code, Option<AgentId>, String), Found>,
}

impl FoundOverTime {
    pub(super) fn new(start: Timestamp) -> Self {
        Self { next: start + EVERY, found: BTreeMap::new() }
    }

    /// Lets the core judge what it was given until `now`, where that is due: once after a gap in the recording.
    pub(super) fn diagnose_until(&mut self, core: &mut Core, now: Timestamp) {
        if self.next > now {
            return;
        }
        // Tokens are no part of a recording: whoever sends is alive.
        core.diagnose(&Tokens::default(), now);
        self.note(core, now);
        self.next = now + EVERY;
    }

    fn note(&mut self, core: &Core, now: Timestamp) {
        // What is found is of the window that was judged last, and before the first one is over of all until now.
        let judged = core.survey().judged_since();
        let (from, to) = judged.map_or((now, now), |since| (since, now.min(since + WINDOW)));
        for finding in core.findings() {
            let is_word = |c: &char| !(c.is_ascii_digit() || matches!(c, '+' | '-' | '.'));
            // Of no agent there may be several of one kind, which differ by more than their numbers.
            let of_whom = if finding.agent.is_some() {
                String::new()
            } else {
                finding.says.chars().filter(is_word).collect()
            };
            let key = (finding.code, finding.agent, of_whom);
            let first = self.found.get(&key).map_or(from, |found| found.first.min(from));
            let last = self.found.get(&key).map_or(to, |found| found.last.max(to));
            self.found.insert(key, Found { finding: finding.clone(), first, last });
        }
    }

    /// Judges what came last, too. Faults first, and of these what was seen first.
    pub(super) fn end(mut self, core: &mut Core, now: Timestamp) -> Vec<Found> {
        core.conclude(&Tokens::default());
        self.note(core, now);
        let mut found: Vec<_> = self.found.into_values().collect();
        found.sort_by_key(|one| (one.finding.severity, one.first));
        found
    }
}
