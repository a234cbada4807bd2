//! Which agents are alive, and the frames of which are all refused.

use crate::engine::{AgentRegistry, MAX_AGENTS};
use std::collections::BTreeSet;
use v2x_common::id::AgentId;

/// Refused frames of an agent, none accepted, after which a warning is due.
const MIN_REFUSALS: u64 = 5;

/// The agents that hold a liveliness token; at most [`MAX_AGENTS`].
#[derive(Debug, Default)]
pub(super) struct Roster {
    alive: BTreeSet<AgentId>,
    warned_of: BTreeSet<AgentId>,
    beyond_limit: u64,
}

impl Roster {
    /// Notes that an agent's token appeared or went. Beyond the limit tokens are only counted: any client can declare
    /// some.
    pub(super) fn note(&mut self, agent: AgentId, is_alive: bool) {
        if is_alive && !self.alive.contains(&agent) {
            if self.alive.len() >= MAX_AGENTS {
                self.beyond_limit += 1;
                tracing::debug!(%agent, "agent joined beyond the limit");
                return;
            }
            self.alive.insert(agent);
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

    /// Tokens that appeared when there was no room for another agent.
    pub(super) const fn beyond_limit(&self) -> u64 {
        self.beyond_limit
    }

    /// One warning for each agent of which no frame was ever accepted, with the main reason.
    pub(super) fn warn_of_refused(&mut self, agents: &AgentRegistry) {
        self.warned_of.retain(|agent| agents.record(agent).is_some());
        for (agent, record) in agents.iter() {
            let statistics = &record.statistics;
            let is_refused = statistics.accepted == 0 && statistics.refused_total() >= MIN_REFUSALS;
            if !is_refused || !self.warned_of.insert(*agent) {
                continue;
            }
            let main = statistics.refused.iter().max_by_key(|(_, count)| **count);
            let (reason, count) = main.map_or(("", 0), |(reason, count)| (reason.as_ref(), *count));
            let last = statistics.last_refusal.as_ref().map(ToString::to_string).unwrap_or_default();
            tracing::warn!(%agent, reason, count, last, "every frame of this agent is refused");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn liveliness_tokens_are_bounded_and_counted_beyond_the_limit() {
        let mut roster = Roster::default();
        let agent = |k: usize| AgentId::new(&format!("a{k}")).unwrap();
        (0..MAX_AGENTS + 7).for_each(|k| roster.note(agent(k), true));
        assert_eq!((roster.alive().count(), roster.beyond_limit()), (MAX_AGENTS, 7));
        roster.note(agent(0), false);
        roster.note(agent(MAX_AGENTS), true);
        assert!(roster.is_alive(&agent(MAX_AGENTS)), "a place became free");
    }
}
