//! Which agents are alive.

use super::change_log::ChangeLog;
use super::token_changes::Token;
use crate::diagnosis::Tokens;
use crate::engine::{Engine, MAX_AGENTS};
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// An agent of which something has arrived within this is alive, with a liveliness token or without.
const ALIVE_BY_TRAFFIC: Span = Span::from_millis(5_000);
/// All tokens are read again this often at most.
const READ_EVERY: Span = Span::from_millis(10_000);

/// So many tokens that change while all of them are read are remembered.
const MOST_CHANGES: usize = 2 * MAX_AGENTS;

/// The agents' liveliness tokens; of at most [`MAX_AGENTS`].
#[derive(Debug, Default)]
pub(super) struct Roster {
    tokens: Tokens,
    beyond_limit: u64,
    changes: ChangeLog,
    /// Whether changes of tokens were lost.
    is_doubtful: bool,
    /// When all of them were read last.
    read_at: Option<Timestamp>,
    /// While all of them are read: the newest state of each that changed meanwhile, which holds, and whether further changes were
    /// lost.
    meanwhile: Option<(BTreeMap<Token, bool>, bool)>,
}

impl Roster {
    /// Notes that a token appeared or went. Beyond the limit tokens are only counted: any client can declare some.
    pub(super) fn note(&mut self, token: &Token, is_there: bool) {
        if let Some((changes, are_lost)) = &mut self.meanwhile {
            if changes.len() < MOST_CHANGES || changes.contains_key(token) {
                changes.insert(token.clone(), is_there);
            } else {
                *are_lost = true;
            }
        }
        self.take_in(token, is_there);
    }

    fn take_in(&mut self, token: &Token, is_there: bool) {
        match &token.rides_on {
            None => self.note_alive(token.agent, is_there),
            Some(rides_on) => self.note_idle(token.agent, rides_on, is_there),
        }
    }

    fn note_alive(&mut self, agent: AgentId, is_alive: bool) {
        let alive = &mut self.tokens.alive;
        if is_alive && !alive.contains(&agent) {
            if alive.len() >= MAX_AGENTS {
                self.beyond_limit += 1;
                tracing::debug!(%agent, "agent joined beyond the limit");
                return;
            }
            alive.insert(agent);
            self.changes.log(agent, "agent joined", None);
        } else if !is_alive && alive.remove(&agent) {
            self.changes.log(agent, "agent left", None);
        }
    }

    /// What an agent rides on is not in the world, or no longer so.
    fn note_idle(&mut self, agent: AgentId, rides_on: &str, is_idle: bool) {
        let idle = &mut self.tokens.idle;
        let known = idle.get(&agent).map(String::as_str);
        if is_idle && known != Some(rides_on) && (idle.len() < MAX_AGENTS || known.is_some()) {
            idle.insert(agent, rides_on.to_owned());
            self.changes.log(agent, "agent is idle", Some(rides_on));
        } else if !is_idle && known == Some(rides_on) {
            idle.remove(&agent);
            self.changes.log(agent, "agent is no longer idle", Some(rides_on));
        }
    }

    /// Whether all tokens are to be read again at `now`, because changes of some were lost, now or before.
    pub(super) fn is_to_be_read(&mut self, are_lost: bool, now: Timestamp) -> bool {
        self.is_doubtful |= are_lost;
        if let Some((_, are_lost_meanwhile)) = &mut self.meanwhile {
            *are_lost_meanwhile |= are_lost;
        }
        let is_due = self.is_doubtful && self.read_at.is_none_or(|at| now - at >= READ_EVERY);
        if is_due {
            self.read_at = Some(now);
            self.meanwhile = Some((BTreeMap::new(), false));
        }
        is_due
    }

    /// Takes in which tokens there were when all of them were read, and after that what has changed meanwhile.
    pub(super) fn renew(&mut self, there: &BTreeSet<Token>) {
        let alive = self.tokens.alive.iter().map(|agent| Token::alive(*agent));
        let idle = self.tokens.idle.iter().map(|(agent, rides_on)| Token::idle(*agent, rides_on.clone()));
        let gone: Vec<_> = alive.chain(idle).filter(|token| !there.contains(token)).collect();
        gone.iter().for_each(|token| self.take_in(token, false));
        let (changes, are_lost) = self.meanwhile.take().unwrap_or_default();
        // Those for which there is no room were counted when they appeared.
        let beyond_limit = self.beyond_limit;
        there.iter().for_each(|token| self.take_in(token, true));
        changes.iter().for_each(|(token, is_there)| self.take_in(token, *is_there));
        self.beyond_limit = beyond_limit;
        self.is_doubtful = are_lost;
    }

    /// Logs once a minute how many changes were not logged one by one.
    pub(super) fn sum_up(&mut self, now: Timestamp) {
        self.changes.sum_up(now);
    }

    /// Whether an agent holds its token, or sends: programs that are not ours may have none.
    pub(super) fn is_alive(&self, agent: &AgentId, engine: &Engine) -> bool {
        let record = engine.agents().record(agent);
        let is_heard = |at| engine.now() - at <= ALIVE_BY_TRAFFIC;
        self.tokens.alive.contains(agent)
            || record.and_then(|record| record.last_heard_at()).is_some_and(is_heard)
    }

    /// The tokens.
    pub(super) const fn tokens(&self) -> &Tokens {
        &self.tokens
    }

    /// Forgets who is alive: those who still are join again.
    pub(super) fn begin_anew(&mut self) {
        self.tokens = Tokens::default();
        self.meanwhile = None;
    }

    /// Tokens that appeared when there was no room for another agent.
    pub(super) const fn beyond_limit(&self) -> u64 {
        self.beyond_limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineConfig;
    use v2x_common::detection::DetectionFrame;
    use v2x_common::id::{FrameId, HubId};
    use v2x_common::time::Timestamp;

    #[test]
    fn a_flood_of_liveliness_tokens_is_bounded_and_counted_beyond_the_limit() {
        let mut roster = Roster::default();
        let agent = |k: usize| AgentId::new(&format!("a{k}")).unwrap();
        (0..MAX_AGENTS + 7).for_each(|k| roster.note(&Token::alive(agent(k)), true));
        assert_eq!((roster.tokens().alive.len(), roster.beyond_limit()), (MAX_AGENTS, 7));
        roster.note(&Token::alive(agent(0)), false);
        roster.note(&Token::alive(agent(MAX_AGENTS)), true);
        assert!(roster.tokens().alive.contains(&agent(MAX_AGENTS)), "a place became free");
    }

    #[test]
    fn a_flood_in_which_changes_of_liveliness_were_lost_is_healed_by_reading_all_of_them_again() {
        let mut roster = Roster::default();
        let [left, stays, idle] = ["left", "stays", "idle"].map(|name| AgentId::new(name).unwrap());
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        for agent in [left, stays, idle] {
            roster.note(&Token::alive(agent), true);
        }
        roster.note(&Token::idle(idle, "veh 1".to_owned()), true);
        assert!(!roster.is_to_be_read(false, at(0)), "nothing was lost");
        assert!(roster.is_to_be_read(true, at(1000)));
        assert!(
            !roster.is_to_be_read(false, at(2000)) && roster.is_to_be_read(false, at(11_000)),
            "it failed"
        );
        let new = AgentId::new("new").unwrap();
        roster.renew(&[stays, idle, new].map(Token::alive).into());
        assert_eq!(roster.tokens().alive, [stays, idle, new].into());
        assert!(roster.tokens().idle.is_empty());
        assert!(!roster.is_to_be_read(false, at(60_000)));
    }

    #[test]
    fn a_flood_that_is_healed_does_not_bring_back_who_has_left_while_all_tokens_were_read() {
        let mut roster = Roster::default();
        let [left, new] = ["left", "new"].map(|name| Token::alive(AgentId::new(name).unwrap()));
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        roster.note(&left, true);
        assert!(roster.is_to_be_read(true, at(0)));
        roster.note(&left, false);
        roster.note(&new, true);
        roster.renew(&[left].into());
        assert_eq!(roster.tokens().alive, [new.agent].into());
        assert!(!roster.is_to_be_read(false, at(20_000)));
        // What is lost while they are read is read again.
        assert!(roster.is_to_be_read(true, at(40_000)) && !roster.is_to_be_read(true, at(40_100)));
        roster.renew(&BTreeSet::new());
        assert!(roster.is_to_be_read(false, at(60_000)));
    }

    #[test]
    fn an_agent_without_a_token_is_alive_as_long_as_it_sends() {
        let mut engine = Engine::new(EngineConfig::new(HubId::new("hub").unwrap(), 1));
        let (agent, roster) = (AgentId::new("a").unwrap(), Roster::default());
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        engine.handle_frame(
            &DetectionFrame::empty(FrameId { agent, epoch: 0, sequence: 1 }, at(1000)),
            at(1020),
        );
        assert!(roster.is_alive(&agent, &engine));
        engine.fused(at(7000));
        assert!(!roster.is_alive(&agent, &engine), "silent for longer than five seconds");
    }
}
