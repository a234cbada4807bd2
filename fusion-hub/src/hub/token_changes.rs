//! Liveliness tokens that appeared or went, until the hub takes that in: of each token the newest state, however often it changed.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use tokio::task::JoinHandle;
use v2x_common::id::AgentId;

/// Tokens whose changes may wait, at most.
const MAX_TOKENS: usize = 4096;
/// Of these of one agent that are not its own: of what it rides on.
const MAX_IDLE_OF_AGENT: usize = 8;

/// A liveliness token of an agent.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Token {
    pub(super) agent: AgentId,
    /// Of a token that says that what it rides on is not in the world: its name.
    pub(super) rides_on: Option<String>,
}

impl Token {
    /// That the agent is there.
    pub(super) const fn alive(agent: AgentId) -> Self {
        Self { agent, rides_on: None }
    }

    /// That what it rides on is not in the world.
    pub(super) const fn idle(agent: AgentId, rides_on: String) -> Self {
        Self { agent, rides_on: Some(rides_on) }
    }
}

/// Whether an agent has enough tokens that are not its own beside this one: the others are those from its first one on.
fn is_one_too_many<'a>(token: &Token, others: impl Iterator<Item = &'a Token>) -> bool {
    token.rides_on.is_some()
        && others.take_while(|other| other.agent == token.agent).count() >= MAX_IDLE_OF_AGENT
}

/// Tokens that there are; of what one agent rides on a few are enough.
#[derive(Debug, Default)]
pub(super) struct TokenSet(BTreeSet<Token>);

impl TokenSet {
    pub(super) fn insert(&mut self, token: Token) {
        if !is_one_too_many(&token, self.0.range(Token::idle(token.agent, String::new())..)) {
            self.0.insert(token);
        }
    }

    pub(super) fn into_inner(self) -> BTreeSet<Token> {
        self.0
    }
}

/// All tokens, which a task of its own reads: the hub goes on meanwhile.
pub(super) type TokensRead = JoinHandle<anyhow::Result<BTreeSet<Token>>>;

/// What became of a token.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TokenChange {
    pub(super) token: Token,
    pub(super) is_there: bool,
    /// After so many changes.
    pub(super) count: u64,
}

/// Those that wait, in the order of the first change of each.
#[derive(Debug, Default)]
pub(super) struct TokenChanges {
    states: BTreeMap<Token, (bool, u64)>,
    order: VecDeque<Token>,
    waiting: u64,
    dropped: u64,
    /// Whether it is not known any more which tokens there are.
    is_lost: bool,
}

impl TokenChanges {
    /// Beyond the limits a change is lost: anybody can declare tokens.
    pub(super) fn push(&mut self, token: Token, is_there: bool) {
        if let Some(state) = self.states.get_mut(&token) {
            *state = (is_there, state.1 + 1);
        } else if self.states.len() >= MAX_TOKENS || self.is_one_too_many(&token) {
            self.dropped += 1;
            self.is_lost = true;
            return;
        } else {
            self.order.push_back(token.clone());
            self.states.insert(token, (is_there, 1));
        }
        self.waiting += 1;
    }

    fn is_one_too_many(&self, token: &Token) -> bool {
        let others = self.states.range(Token::idle(token.agent, String::new())..);
        is_one_too_many(token, others.map(|(other, _)| other))
    }

    pub(super) fn pop(&mut self) -> Option<TokenChange> {
        let token = self.order.pop_front()?;
        let (is_there, count) = self.states.remove(&token)?;
        self.waiting -= count;
        Some(TokenChange { token, is_there, count })
    }

    /// Whether changes were lost since the last call.
    pub(super) const fn take_lost(&mut self) -> bool {
        std::mem::replace(&mut self.is_lost, false)
    }

    /// As if changes were lost.
    pub(super) const fn doubt(&mut self) {
        self.is_lost = true;
    }

    /// Changes that wait, and that were lost.
    pub(super) const fn counts(&self) -> (u64, u64) {
        (self.waiting, self.dropped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn agent(k: usize) -> AgentId {
        AgentId::new(&format!("a{k}")).unwrap()
    }

    #[test]
    fn a_flood_of_tokens_is_bounded_and_what_is_lost_is_known() {
        let mut changes = TokenChanges::default();
        (0..MAX_TOKENS).for_each(|k| changes.push(Token::alive(agent(k)), true));
        assert!(!changes.take_lost());
        // What waits already takes no more room.
        changes.push(Token::alive(agent(0)), false);
        assert_eq!((changes.counts(), changes.take_lost()), ((MAX_TOKENS as u64 + 1, 0), false));
        changes.push(Token::alive(agent(MAX_TOKENS)), true);
        assert_eq!((changes.counts().1, changes.take_lost(), changes.take_lost()), (1, true, false));
        let first = changes.pop().unwrap();
        assert_eq!(first, TokenChange { token: Token::alive(agent(0)), is_there: false, count: 2 });
        assert_eq!(std::iter::from_fn(|| changes.pop()).count(), MAX_TOKENS - 1);
        assert_eq!(changes.counts(), (0, 1));
    }

    #[test]
    fn a_flood_of_one_agents_tokens_takes_a_few_places() {
        let mut changes = TokenChanges::default();
        (0..1000).for_each(|k| changes.push(Token::idle(agent(1), format!("veh{k}")), true));
        changes.push(Token::alive(agent(1)), true);
        changes.push(Token::idle(agent(10), "veh".to_owned()), true);
        assert_eq!(std::iter::from_fn(|| changes.pop()).count(), MAX_IDLE_OF_AGENT + 2);
    }
}
