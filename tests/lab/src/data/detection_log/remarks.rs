//! What is counted of a log's rows: dropped detections, unknown classes.

use serde::Serialize;
use std::collections::BTreeMap;
use v2x_common::detection::InvalidValue;
use v2x_common::id::AgentId;
use v2x_common::unmapped_names::UnmappedNames;

/// Impossible detections of one kind, which were dropped.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Dropped {
    /// Which sensor's.
    pub sensor: AgentId,
    /// The first impossible field of each, as errors name it.
    pub field: &'static str,
    /// `not finite` or `out of range`.
    pub cause: &'static str,
    /// How many.
    pub count: u64,
    /// Line of the first one.
    pub first_line: u64,
    /// The first one in words.
    pub first: String,
}

/// What is counted so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Remarks {
    dropped: BTreeMap<(AgentId, &'static str, &'static str), Dropped>,
    /// Unknown class names.
    pub unmapped: UnmappedNames,
    /// The same of each sensor that has any.
    unmapped_of: BTreeMap<AgentId, UnmappedNames>,
}

impl Remarks {
    /// Counts one; a place that is none near the origin is said in words of its own.
    pub(super) fn note_dropped(
        &mut self,
        sensor: AgentId,
        line: u64,
        (invalid, off): (&InvalidValue, Option<String>),
    ) {
        let (field, cause) = (invalid.field, invalid.cause());
        let first = || {
            let first = off.unwrap_or_else(|| invalid.to_string());
            Dropped { sensor, field, cause, count: 0, first_line: line, first }
        };
        self.dropped.entry((sensor, field, cause)).or_insert_with(first).count += 1;
    }

    pub(super) fn note_unmapped(&mut self, sensor: AgentId, name: &str) {
        self.unmapped.add(name);
        self.unmapped_of.entry(sensor).or_default().add(name);
    }

    /// Unknown class names of each sensor that has any.
    pub(crate) fn unmapped_of(&self) -> impl Iterator<Item = (&AgentId, &UnmappedNames)> {
        self.unmapped_of.iter()
    }

    /// The dropped detections, by sensor, field and cause.
    pub(crate) fn dropped(&self) -> impl Iterator<Item = &Dropped> {
        self.dropped.values()
    }
}
