//! Which agents are alive.

use crate::diagnosis::Tokens;
use crate::engine::{Engine, MAX_AGENTS};
use v2x_common::id::AgentId;
use v2x_common::time::Span;

/// An agent of which something has arrived within this is alive, with a liveliness token or without.
const ALIVE_BY_TRAFFIC: Span = Span::from_millis(5_000);

/// The agents' liveliness tokens; of at most [`MAX_AGENTS`].
#[derive(Debug, Default)]
pub(super) struct Roster {
    tokens: Tokens,
    beyond_limit: u64,
}

impl Roster {
    /// Notes that an agent's token appeared or went. Beyond the limit tokens are only counted: any client can declare
    /// some.
    pub(super) fn note(&mut self, agent: AgentId, is_alive: bool) {
        let alive = &mut self.tokens.alive;
        if is_alive && !alive.contains(&agent) {
            if alive.len() >= MAX_AGENTS {
                self.beyond_limit += 1;
                tracing::debug!(%agent, "agent joined beyond the limit");
                return;
            }
            alive.insert(agent);
            tracing::info!(%agent, "agent joined");
        } else if !is_alive && alive.remove(&agent) {
            tracing::info!(%agent, "agent left");
        }
    }

    /// Notes that what an agent rides on is not in the world, or no longer so.
    pub(super) fn note_idle(&mut self, agent: AgentId, rides_on: String, is_idle: bool) {
        let idle = &mut self.tokens.idle;
        if is_idle && (idle.len() < MAX_AGENTS || idle.contains_key(&agent)) {
            tracing::info!(%agent, rides_on, "agent is idle");
            idle.insert(agent, rides_on);
        } else if !is_idle && idle.get(&agent) == Some(&rides_on) {
            tracing::info!(%agent, rides_on, "agent is no longer idle");
            idle.remove(&agent);
        }
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
    fn liveliness_tokens_are_bounded_and_counted_beyond_the_limit() {
        let mut roster = Roster::default();
        let agent = |k: usize| AgentId::new(&format!("a{k}")).unwrap();
        (0..MAX_AGENTS + 7).for_each(|k| roster.note(agent(k), true));
        assert_eq!((roster.tokens().alive.len(), roster.beyond_limit()), (MAX_AGENTS, 7));
        roster.note(agent(0), false);
        roster.note(agent(MAX_AGENTS), true);
        assert!(roster.tokens().alive.contains(&agent(MAX_AGENTS)), "a place became free");
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
