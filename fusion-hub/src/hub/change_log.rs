//! The log of who joins and leaves: the first changes of each agent one by one, the others once a minute as a sum, so that
//! a client that declares and withdraws a token again and again does not flood the log.

use crate::engine::MAX_AGENTS;
use std::collections::BTreeMap;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Changes of one agent that are logged one by one, each minute.
const LOGGED_OF_AGENT: u64 = 4;
/// After this the others are summed up, and all begin anew.
const SUMMED_UP_EVERY: Span = Span::from_millis(60_000);

/// Changes since the last sum.
#[derive(Debug, Default)]
pub(super) struct ChangeLog {
    since: Option<Timestamp>,
    by_agent: BTreeMap<AgentId, u64>,
    /// Changes of agents for which there was no room.
    of_others: u64,
}

impl ChangeLog {
    /// Logs a change of an agent, unless too many of it were logged already.
    pub(super) fn log(&mut self, agent: AgentId, what: &str, rides_on: Option<&str>) {
        if self.is_logged(agent) {
            tracing::info!(%agent, rides_on, "{what}");
        } else {
            tracing::debug!(%agent, rides_on, "{what}");
        }
    }

    fn is_logged(&mut self, agent: AgentId) -> bool {
        if self.by_agent.len() >= MAX_AGENTS && !self.by_agent.contains_key(&agent) {
            self.of_others += 1;
            return false;
        }
        let count = self.by_agent.entry(agent).or_default();
        *count += 1;
        *count <= LOGGED_OF_AGENT
    }

    /// Logs the number of changes that were not logged one by one, once a minute.
    pub(super) fn sum_up(&mut self, now: Timestamp) {
        if let Some(sum) = self.take_sum(now) {
            tracing::info!("{sum}");
        }
    }

    fn take_sum(&mut self, now: Timestamp) -> Option<String> {
        if now - *self.since.get_or_insert(now) < SUMMED_UP_EVERY {
            return None;
        }
        let Self { by_agent, of_others, .. } = std::mem::take(self);
        self.since = Some(now);
        let unlogged = by_agent.iter().map(|(agent, count)| (count.saturating_sub(LOGGED_OF_AGENT), agent));
        let (most, of_agents) = (unlogged.clone().max(), unlogged.map(|(count, _)| count).sum::<u64>());
        let count = of_agents + of_others;
        let most =
            most.filter(|(most, _)| *most > 0).map(|(most, agent)| format!(", most often {agent} ({most})"));
        (count > 0).then(|| {
            format!("agents joined, left or were idle {count} more times lately{}", most.unwrap_or_default())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_one_agents_joining_and_leaving_is_logged_a_few_times_and_summed_up_and_hides_no_other() {
        let mut log = ChangeLog::default();
        let [flood, quiet] = ["flood", "quiet"].map(|name| AgentId::new(name).unwrap());
        let at = |seconds: i64| Timestamp::EPOCH + Span::from_millis(1000 * seconds);
        assert_eq!(log.take_sum(at(0)), None);
        assert_eq!((0..1000).filter(|_| log.is_logged(flood)).count(), 4);
        assert!(log.is_logged(quiet));
        assert_eq!(log.take_sum(at(59)), None);
        let sum = "agents joined, left or were idle 996 more times lately, most often flood (996)";
        assert_eq!(log.take_sum(at(60)).as_deref(), Some(sum));
        assert!(log.is_logged(flood), "its first change of each minute is logged");
        assert_eq!(log.take_sum(at(120)), None);
    }

    #[test]
    fn a_flood_of_names_is_summed_up() {
        let mut log = ChangeLog::default();
        log.take_sum(Timestamp::EPOCH);
        let name = |k: usize| AgentId::new(&format!("a{k}")).unwrap();
        assert_eq!((0..MAX_AGENTS + 50).filter(|k| log.is_logged(name(*k))).count(), MAX_AGENTS);
        let sum = log.take_sum(Timestamp::EPOCH + SUMMED_UP_EVERY);
        assert_eq!(sum.as_deref(), Some("agents joined, left or were idle 50 more times lately"));
    }
}
