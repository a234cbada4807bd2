//! Who is alive, and whose frames are all refused.

use crate::inbox::Inbox;
use std::collections::BTreeSet;
use v2x_common::id::AgentId;

/// Refused frames of an agent, none accepted, after which a person should know.
const TELLING_REFUSALS: u64 = 5;

/// The agents that hold a liveliness token.
#[derive(Debug, Default)]
pub(super) struct Roster {
    alive: BTreeSet<AgentId>,
    told: BTreeSet<AgentId>,
}

impl Roster {
    pub(super) fn note(&mut self, agent: AgentId, is_alive: bool) {
        if is_alive && self.alive.insert(agent) {
            tracing::info!(%agent, "agent joined");
        } else if !is_alive && self.alive.remove(&agent) {
            tracing::info!(%agent, "agent left");
        }
    }

    pub(super) fn is_alive(&self, agent: &AgentId) -> bool {
        self.alive.contains(agent)
    }

    pub(super) fn alive(&self) -> impl Iterator<Item = &AgentId> {
        self.alive.iter()
    }

    /// One line for each agent of which nothing was ever accepted, with the main reason.
    pub(super) fn tell_of_hopeless(&mut self, inbox: &Inbox) {
        for (agent, record) in inbox.agents() {
            if record.accepted > 0 || record.refused_total() < TELLING_REFUSALS || !self.told.insert(*agent) {
                continue;
            }
            let main = record.refused.iter().max_by_key(|(_, count)| **count);
            let (reason, count) = main.map_or(("", 0), |(reason, count)| (*reason, *count));
            let last = record.last_refusal.as_ref().map(ToString::to_string).unwrap_or_default();
            tracing::warn!(%agent, reason, count, last, "every frame of this agent is refused");
        }
    }
}
