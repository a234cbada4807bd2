//! What waits beside detection frames: changes of liveliness, sensor descriptions and queries. Each kind waits apart and has its
//! turn, so that none keeps another one out; descriptions and tokens also have a place for each agent.
//!
//! Queries are answered on a thread of its own: a reply, and the end of a query, which is sent when it is dropped, wait up to five
//! seconds for whoever asks and reads nothing. While too many answers wait, so do the queries.

use super::fair_queue::{FairQueue, QueueLimits};
use super::intake::Received;
use super::limits::MAX_WAITING;
use super::outbox::Outbox;
use super::token_changes::{Token, TokenChange, TokenChanges};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;
use v2x_common::clock;
use v2x_common::net::queue::{DropOldestQueue, QueueCounts};
use v2x_common::wire::ENCODING_JSON;
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::query::Query;

/// Descriptions that may wait: as many as frames, and of fewer bytes.
const DESCRIPTIONS: QueueLimits = QueueLimits {
    frames_of_agent: MAX_WAITING,
    bytes_of_agent: 4 << 20,
    bytes: 32 << 20,
    ..QueueLimits::DEFAULT
};
/// Queries of one kind that may wait.
const QUERIES: usize = 512;
/// Most bytes of a query's payload, parameters and attachment together: a hub reads none of them.
const MAX_QUERY_BYTES: usize = 4096;
/// Tokens, descriptions, and two kinds of queries.
const KINDS: usize = 4;

/// Samples and queries that are not detection frames.
pub(super) enum Control {
    Token(TokenChange),
    Description(Received),
    /// A recorder asks for a start of the journal.
    JournalQuery(Query),
    StatusQuery(Query, Asked),
}

/// Whose status is asked for: one query can ask for both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// Of the hub that publishes.
    Hub,
    /// Of this hub as one that stands by.
    Standby,
}

/// What is said to whoever asks: a key and JSON; nothing, where another hub answers or the query was dropped.
struct Reply {
    query: Query,
    said: Option<(String, Vec<u8>)>,
}

impl Reply {
    /// Sends it, and that it is all: under a key of its own, as answers under one key replace each other.
    fn send(self) {
        let Some((key, json)) = self.said else { return };
        if let Err(error) = self.query.reply(key, json).encoding(ENCODING_JSON).wait() {
            tracing::debug!(%error, "query not answered");
        }
    }
}

/// What came and what became of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct QueueState {
    pub(super) items: QueueCounts,
    /// Queries that were larger than is read.
    pub(super) queries_refused: u64,
}

/// Filled by other threads, for one reader.
pub(super) struct ControlQueue {
    tokens: Mutex<TokenChanges>,
    descriptions: FairQueue<Received>,
    journal: DropOldestQueue<Query>,
    status: DropOldestQueue<(Query, Asked)>,
    queries_refused: AtomicU64,
    answers: Outbox<Reply>,
    arrived: Arc<Notify>,
    /// The kind whose turn it is.
    turn: AtomicUsize,
    /// What the reader has taken.
    taken: AtomicU64,
}

impl ControlQueue {
    pub(super) fn new() -> Self {
        let arrived = Arc::new(Notify::new());
        // Queries that waited for room have it.
        let has_room = arrived.clone();
        let answers = Outbox::new(move |reply: Reply| {
            reply.send();
            has_room.notify_one();
        });
        Self {
            tokens: Mutex::default(),
            descriptions: FairQueue::new(DESCRIPTIONS),
            journal: DropOldestQueue::new(QUERIES),
            status: DropOldestQueue::new(QUERIES),
            queries_refused: AtomicU64::new(0),
            answers,
            arrived,
            turn: AtomicUsize::new(0),
            taken: AtomicU64::new(0),
        }
    }

    fn tokens(&self) -> MutexGuard<'_, TokenChanges> {
        // Counts are at worst off by one item after a panic: a poisoned lock is safe to use.
        self.tokens.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts an item at the end of its kind, from any thread, without waiting.
    pub(super) fn push(&self, item: Control) {
        match item {
            Control::Token(TokenChange { token, is_there, .. }) => self.tokens().push(token, is_there),
            Control::Description(received) => {
                let (sender, bytes) = ((received.agent, received.received_at), received.bytes());
                self.descriptions.push(sender, bytes, received);
            }
            Control::JournalQuery(query) => {
                let rest = match size_of(&query) {
                    ..=MAX_QUERY_BYTES => self.journal.push_displacing(query),
                    _ => self.refused(query),
                };
                self.end(rest);
            }
            Control::StatusQuery(query, asked) => {
                let rest = match size_of(&query) {
                    ..=MAX_QUERY_BYTES => self.status.push_displacing((query, asked)).map(|(query, _)| query),
                    _ => self.refused(query),
                };
                self.end(rest);
            }
        }
        self.arrived.notify_one();
    }

    /// Counts a query that is too large.
    fn refused(&self, query: Query) -> Option<Query> {
        self.queries_refused.fetch_add(1, Ordering::Relaxed);
        Some(query)
    }

    /// Ends a query without an answer.
    fn end(&self, query: Option<Query>) {
        let Some(query) = query else { return };
        let bytes = size_of(&query);
        // Where thousands wait, the thread that brought one waits itself.
        let _kept_back = self.answers.push_rest(Reply { query, said: None }, bytes);
    }

    /// Answers a query that was taken out, with nothing where that is `None`; without waiting for whoever asks.
    pub(super) fn answer(&self, query: Query, said: Option<(String, Vec<u8>)>) {
        let bytes = said.as_ref().map_or(0, |(_, json)| json.len());
        self.answers.push(Reply { query, said }, bytes);
    }

    /// Notes that a token appeared or went.
    pub(super) fn push_token(&self, token: Token, is_there: bool) {
        self.push(Control::Token(TokenChange { token, is_there, count: 1 }));
    }

    /// The next item, if there is one: the kinds take turns.
    pub(super) fn try_pop(&self) -> Option<Control> {
        let turn = self.turn.load(Ordering::Relaxed);
        let (kind, item) =
            (0..KINDS).map(|k| (turn + k) % KINDS).find_map(|kind| Some((kind, self.pop(kind)?)))?;
        self.turn.store(kind + 1, Ordering::Relaxed);
        let count = if let Control::Token(change) = &item { change.count } else { 1 };
        self.taken.fetch_add(count, Ordering::Relaxed);
        Some(item)
    }

    fn pop(&self, kind: usize) -> Option<Control> {
        match kind {
            0 => self.tokens().pop().map(Control::Token),
            1 => self.descriptions.try_pop(clock::now()).map(Control::Description),
            _ if self.answers.is_full() => None,
            2 => self.journal.try_pop().map(Control::JournalQuery),
            _ => self.status.try_pop().map(|(query, asked)| Control::StatusQuery(query, asked)),
        }
    }

    /// Waits until there is an item, without removing it. For one reader.
    pub(super) async fn wait(&self) {
        while self.is_empty() {
            self.arrived.notified().await;
        }
    }

    /// Whether there is nothing to take: queries wait for room for their answers.
    pub(super) fn is_empty(&self) -> bool {
        let queries = || self.journal.counts().waiting + self.status.counts().waiting;
        self.tokens().counts().0 + self.descriptions.counts().0 == 0
            && (queries() == 0 || self.answers.is_full())
    }

    /// Whether changes of tokens were lost since the last call.
    pub(super) fn take_lost_tokens(&self) -> bool {
        self.tokens().take_lost()
    }

    /// From now on it is not known which tokens there are.
    pub(super) fn doubt_tokens(&self) {
        self.tokens().doubt();
    }

    /// What has come: what the reader has taken, what waits and what was dropped.
    pub(super) fn counts(&self) -> QueueState {
        // It does not keep for ever whose descriptions were dropped: nobody asks.
        self.descriptions.take_dropped();
        let (tokens, descriptions) = (self.tokens().counts(), self.descriptions.counts());
        let (journal, status) = (self.journal.counts(), self.status.counts());
        let parts =
            [tokens, descriptions, (journal.waiting, journal.dropped), (status.waiting, status.dropped)];
        let waiting = parts.iter().map(|(waiting, _)| waiting).sum();
        let dropped = parts.iter().map(|(_, dropped)| dropped).sum();
        let queries_refused = self.queries_refused.load(Ordering::Relaxed);
        let received = self.taken.load(Ordering::Relaxed) + queries_refused + waiting + dropped;
        QueueState { items: QueueCounts { received, waiting, dropped }, queries_refused }
    }

    /// Number of dropped items.
    pub(super) fn dropped(&self) -> u64 {
        self.counts().items.dropped
    }
}

/// Bytes of what a query brings beside its key.
fn size_of(query: &Query) -> usize {
    let bytes = [query.payload(), query.attachment()].into_iter().flatten().map(ZBytes::len);
    bytes.sum::<usize>() + query.parameters().as_str().len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::AgentId;

    fn agent(name: &str) -> AgentId {
        AgentId::new(name).unwrap()
    }

    fn description(name: &str, k: u32) -> Control {
        Control::Description(Received::of(agent(name), &k.to_le_bytes()))
    }

    #[test]
    fn a_flood_of_one_agents_descriptions_and_tokens_keeps_out_no_other_agent_and_no_other_kind() {
        let queue = ControlQueue::new();
        queue.push(description("quiet", 7));
        queue.push_token(Token::alive(agent("quiet")), false);
        for k in 0..20_000 {
            queue.push(description("flood", k));
            queue.push_token(Token::alive(agent("flood")), k % 2 == 0);
        }
        let (mut of_flood, mut of_quiet, mut left) = (0, 0, None);
        while let Some(item) = queue.try_pop() {
            match item {
                Control::Description(received) if received.agent == agent("quiet") => of_quiet += 1,
                Control::Description(_) => of_flood += 1,
                Control::Token(change) if change.token.agent == agent("quiet") => left = Some(change),
                Control::Token(change) => assert_eq!((change.is_there, change.count), (false, 20_000)),
                Control::JournalQuery(_) | Control::StatusQuery(..) => {}
            }
        }
        assert!(of_quiet == 1 && (1..=MAX_WAITING).contains(&of_flood), "{of_quiet} {of_flood}");
        assert!(left.is_some_and(|change| !change.is_there), "that it left is not lost");
        let counts = queue.counts().items;
        assert_eq!((counts.received, counts.waiting), (40_002, 0));
        assert!(!queue.take_lost_tokens());
    }

    #[test]
    fn kinds_take_turns_whoever_floods_the_others() {
        let queue = ControlQueue::new();
        (0..50).for_each(|k| queue.push(description("flood", k)));
        queue.push_token(Token::alive(agent("late")), true);
        let is_token = |item: Option<Control>| matches!(item, Some(Control::Token(_)));
        assert!(is_token(queue.try_pop()) || is_token(queue.try_pop()));
    }
}
