//! What a hub finds wrong with its agents over the time of a recording.

use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::diagnosis::{Code, Finding, Tokens};
use v2x_fusion_hub::hub::Core;

/// The live hub looks as often.
const EVERY: Span = Span::from_millis(1000);

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

/// Looks once a second.
#[derive(Debug)]
pub(super) struct Lookout {
    next: Timestamp,
    found: BTreeMap<(Code, Option<AgentId>), Found>,
}

impl Lookout {
    pub(super) fn new(start: Timestamp) -> Self {
        Self { next: start + EVERY, found: BTreeMap::new() }
    }

    /// Looks at all times until `now` that are due. A gap in the recording is looked at once.
    pub(super) fn look_until(&mut self, core: &mut Core, now: Timestamp) {
        if self.next > now {
            return;
        }
        // Tokens are no part of a recording: whoever sends is alive.
        core.look(&Tokens::default(), now);
        for finding in core.findings() {
            let key = (finding.code, finding.agent);
            let first = self.found.get(&key).map_or(now, |found| found.first);
            self.found.insert(key, Found { finding: finding.clone(), first, last: now });
        }
        self.next = now + EVERY;
    }

    /// Faults first, and of these what was seen first.
    pub(super) fn end(self) -> Vec<Found> {
        let mut found: Vec<_> = self.found.into_values().collect();
        found.sort_by_key(|one| (one.finding.severity, one.first));
        found
    }
}
