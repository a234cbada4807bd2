//! Frames that wait, one queue for each agent: nobody takes more than a fair share of the hub's time.
//!
//! Fair queuing by measured cost, as start-time fair queuing (Goyal, Vin & Cheng 1996): the agent whose frames have cost the
//! hub least is served next, and one that was idle starts where the others are. Where the hub has time for everybody nobody
//! notices; where it has not, frames of those that cost most wait, and of these the oldest are dropped.

use super::limits::MAX_WAITING;
use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Agents whose frames have cost the hub the same but for this are served in the order of arrival: late data costs more.
const QUANTUM: Span = Span::from_millis(5);

/// A frame that has waited for longer gives way to a newer one of its agent: where there is no time for all, that which there
/// is goes to what is still of use, and what is taken in is in order.
const STALE_AFTER: Span = Span::from_millis(100);
/// There is no time for all where frames have waited without a pause for so long. Who was only held up catches up sooner, and
/// loses nothing.
const OVERLOADED_AFTER: Span = Span::from_millis(500);

/// What may wait.
#[derive(Clone, Copy, Debug)]
pub(super) struct QueueLimits {
    /// Frames of one agent.
    pub(super) frames_of_agent: usize,
    /// Bytes of one agent.
    pub(super) bytes_of_agent: usize,
    /// Bytes of all.
    pub(super) bytes: usize,
    /// Agents.
    pub(super) agents: usize,
}

impl QueueLimits {
    /// [`MAX_WAITING`] frames of an agent; a few of its largest ones; and what a small machine has room for.
    pub(super) const DEFAULT: Self =
        Self { frames_of_agent: MAX_WAITING, bytes_of_agent: 16 << 20, bytes: 128 << 20, agents: 2048 };
}

/// Frames that wait, filled by other threads, for one reader.
#[derive(Debug)]
pub(super) struct FairQueue<T> {
    shares: Mutex<Shares<T>>,
    arrived: Notify,
}

/// The queues of all agents.
#[derive(Debug)]
struct Shares<T> {
    limits: QueueLimits,
    by_agent: HashMap<AgentId, Share<T>>,
    bytes: usize,
    n_waiting: usize,
    /// Since when frames have waited without a pause.
    busy_since: Timestamp,
    /// The work of the agent that was served last, in the time of all: ns.
    level: i64,
    /// Counts arrivals.
    arrivals: u64,
    /// Dropped frames of agents, until they are asked for.
    dropped: BTreeMap<AgentId, u64>,
    dropped_total: u64,
}

/// The queue of one agent.
#[derive(Debug)]
struct Share<T> {
    waiting: VecDeque<Waiting<T>>,
    bytes: usize,
    /// What its frames have cost, ns, at least the level at which it was idle.
    work: i64,
}

#[derive(Debug)]
struct Waiting<T> {
    item: T,
    bytes: usize,
    arrival: u64,
    at: Timestamp,
}

impl<T> FairQueue<T> {
    pub(super) fn new(limits: QueueLimits) -> Self {
        let shares = Shares {
            limits,
            by_agent: HashMap::new(),
            bytes: 0,
            n_waiting: 0,
            busy_since: Timestamp::MIN,
            level: 0,
            arrivals: 0,
            dropped: BTreeMap::new(),
            dropped_total: 0,
        };
        Self { shares: Mutex::new(shares), arrived: Notify::new() }
    }

    fn lock(&self) -> MutexGuard<'_, Shares<T>> {
        // Counts are at worst off by one item after a panic: a poisoned lock is safe to use.
        self.shares.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a frame of so many bytes that arrives at `at` at the end of its agent's queue, from any thread, without waiting.
    pub(super) fn push(&self, (agent, at): (AgentId, Timestamp), bytes: usize, item: T) {
        self.lock().push((agent, at), bytes, item);
        self.arrived.notify_one();
    }

    /// The next frame at `now`, if there is one.
    pub(super) fn try_pop(&self, now: Timestamp) -> Option<T> {
        self.lock().pop(now)
    }

    /// Waits until there is a frame, without removing it. For one reader.
    pub(super) async fn wait(&self) {
        while self.len() == 0 {
            self.arrived.notified().await;
        }
    }

    /// How many frames wait.
    pub(super) fn len(&self) -> usize {
        self.lock().n_waiting
    }

    /// Notes what a frame of an agent has cost.
    pub(super) fn note_cost(&self, agent: &AgentId, cost: Span) {
        self.lock().note_cost(agent, cost);
    }

    /// Dropped frames of each agent since the last call.
    pub(super) fn take_dropped(&self) -> BTreeMap<AgentId, u64> {
        std::mem::take(&mut self.lock().dropped)
    }

    /// How many frames wait, and how many were dropped.
    pub(super) fn counts(&self) -> (u64, u64) {
        let shares = self.lock();
        (shares.n_waiting as u64, shares.dropped_total)
    }

    /// All dropped frames.
    pub(super) fn dropped(&self) -> u64 {
        self.lock().dropped_total
    }
}

impl<T> Share<T> {
    /// Whether the oldest frame has waited for so long that the next one is worth more than it.
    fn has_stale(&self, now: Timestamp) -> bool {
        self.waiting.len() > 1 && self.waiting.front().is_some_and(|oldest| now - oldest.at > STALE_AFTER)
    }
}

impl<T> Shares<T> {
    fn push(&mut self, (agent, at): (AgentId, Timestamp), bytes: usize, item: T) {
        if !self.by_agent.contains_key(&agent) && self.by_agent.len() >= self.limits.agents {
            self.forget_idle();
            if self.by_agent.len() >= self.limits.agents {
                self.dropped_total += 1;
                return;
            }
        }
        if self.n_waiting == 0 {
            self.busy_since = at;
        }
        let arrival = self.arrivals;
        self.arrivals += 1;
        let level = self.level;
        let share = self.by_agent.entry(agent).or_insert_with(|| Share {
            waiting: VecDeque::new(),
            bytes: 0,
            work: level,
        });
        if share.waiting.is_empty() {
            share.work = share.work.max(level);
        }
        share.waiting.push_back(Waiting { item, bytes, arrival, at });
        share.bytes += bytes;
        self.bytes += bytes;
        self.n_waiting += 1;
        let QueueLimits { frames_of_agent, bytes_of_agent, .. } = self.limits;
        while self.by_agent.get(&agent).is_some_and(|share| {
            share.waiting.len() > 1 && (share.waiting.len() > frames_of_agent || share.bytes > bytes_of_agent)
        }) {
            self.drop_oldest(agent);
        }
        while self.bytes > self.limits.bytes
            && let Some(heaviest) = self.heaviest()
        {
            self.drop_oldest(heaviest);
        }
    }

    fn heaviest(&self) -> Option<AgentId> {
        let waiting = self.by_agent.iter().filter(|(_, share)| !share.waiting.is_empty());
        waiting.max_by_key(|(agent, share)| (share.bytes, **agent)).map(|(agent, _)| *agent)
    }

    fn drop_oldest(&mut self, agent: AgentId) {
        if self.take_oldest(&agent).is_some() {
            self.dropped_total += 1;
            *self.dropped.entry(agent).or_default() += 1;
        }
    }

    fn take_oldest(&mut self, agent: &AgentId) -> Option<T> {
        let share = self.by_agent.get_mut(agent)?;
        let oldest = share.waiting.pop_front()?;
        share.bytes -= oldest.bytes;
        self.bytes -= oldest.bytes;
        self.n_waiting -= 1;
        Some(oldest.item)
    }

    fn pop(&mut self, now: Timestamp) -> Option<T> {
        if self.n_waiting == 0 {
            return None;
        }
        let waiting = || self.by_agent.iter().filter(|(_, share)| !share.waiting.is_empty());
        let least = waiting().map(|(_, share)| share.work).min()?;
        let key = |share: &Share<T>| {
            let arrival = share.waiting.front().map_or(u64::MAX, |oldest| oldest.arrival);
            ((share.work - least) / QUANTUM.as_nanos(), arrival)
        };
        let agent = *waiting().min_by_key(|(_, share)| key(share))?.0;
        self.level = self.level.max(least);
        if now - self.busy_since > OVERLOADED_AFTER {
            while self.by_agent.get(&agent).is_some_and(|share| share.has_stale(now)) {
                self.drop_oldest(agent);
            }
        }
        self.take_oldest(&agent)
    }

    fn note_cost(&mut self, agent: &AgentId, cost: Span) {
        if let Some(share) = self.by_agent.get_mut(agent) {
            share.work = share.work.saturating_add(cost.as_nanos().max(0));
        }
        if self.n_waiting == 0 {
            // Nobody waits: what was before does not count any more.
            self.level = self.by_agent.values().map(|share| share.work).max().unwrap_or(self.level);
        }
    }

    fn forget_idle(&mut self) {
        self.by_agent.retain(|_, share| !share.waiting.is_empty());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: Timestamp = Timestamp::EPOCH;

    fn agent(name: &str) -> AgentId {
        AgentId::new(name).unwrap()
    }

    fn shares(limits: QueueLimits) -> Shares<(&'static str, u32)> {
        FairQueue::new(limits).shares.into_inner().unwrap()
    }

    #[test]
    fn frames_are_served_in_their_order_where_nobody_takes_too_much() {
        let mut shares = shares(QueueLimits::DEFAULT);
        for (k, name) in (0..).zip(["a", "b", "a", "c"]) {
            shares.push((agent(name), AT), 100, (name, k));
        }
        let served: Vec<_> = std::iter::from_fn(|| shares.pop(AT)).collect();
        assert_eq!(served, [("a", 0), ("b", 1), ("a", 2), ("c", 3)]);
    }

    #[test]
    fn a_flood_of_frames_that_cost_much_gets_no_more_time_than_each_other_agent() {
        let mut shares = shares(QueueLimits::DEFAULT);
        let (mut work, mut frames) = (HashMap::new(), HashMap::new());
        // A second of 20 ms, in which everybody sends more than there is time for.
        for _ in 0..2000 {
            for name in ["dear", "cheap", "modest"] {
                shares.push((agent(name), AT), 100, (name, 0));
            }
            let (name, _) = shares.pop(AT).unwrap();
            let cost_us = if name == "dear" { 30_000 } else { 300 };
            shares.note_cost(&agent(name), Span::from_micros(cost_us));
            *work.entry(name).or_insert(0) += cost_us;
            *frames.entry(name).or_insert(0) += 1;
        }
        assert!((work["dear"] - work["cheap"]).abs() <= 35_000, "{work:?}");
        assert!(frames["cheap"] > 900 && frames["modest"] > 900, "{frames:?}");
    }

    #[test]
    fn who_was_idle_starts_where_the_others_are_and_owes_nothing_for_what_nobody_else_wanted() {
        let mut shares = shares(QueueLimits::DEFAULT);
        for k in 0..100 {
            shares.push((agent("busy"), AT), 100, ("busy", k));
            shares.pop(AT);
            shares.note_cost(&agent("busy"), Span::from_millis(1));
        }
        let mut served = HashMap::new();
        for k in 0..100 {
            shares.push((agent("busy"), AT), 100, ("busy", k));
            shares.push((agent("late"), AT), 100, ("late", k));
            let (name, _) = shares.pop(AT).unwrap();
            shares.note_cost(&agent(name), Span::from_millis(1));
            *served.entry(name).or_insert(0) += 1;
        }
        assert!((45..=55).contains(&served["late"]), "{served:?}");
    }

    #[test]
    fn each_agent_has_limits_of_its_own_and_the_heaviest_gives_way_where_all_are_too_much() {
        let limits = QueueLimits { frames_of_agent: 2, bytes_of_agent: 1000, bytes: 1500, agents: 3 };
        let mut shares = shares(limits);
        (0..4).for_each(|k| shares.push((agent("many"), AT), 10, ("many", k)));
        assert_eq!(shares.dropped.remove(&agent("many")), Some(2));
        shares.push((agent("large"), AT), 5000, ("large", 0));
        shares.push((agent("small"), AT), 100, ("small", 0));
        assert_eq!(shares.dropped, BTreeMap::from([(agent("large"), 1)]), "alone it is more than all may be");
        shares.push((agent("beyond"), AT), 1, ("beyond", 0));
        assert_eq!((shares.dropped_total, shares.n_waiting), (3, 4), "the idle one makes room");
        shares.push((agent("more"), AT), 1, ("more", 0));
        assert_eq!((shares.dropped_total, shares.n_waiting), (4, 4));
        let served: Vec<_> = std::iter::from_fn(|| shares.pop(AT)).collect();
        assert_eq!(served, [("many", 2), ("many", 3), ("small", 0), ("beyond", 0)]);
        assert_eq!((shares.bytes, shares.n_waiting), (0, 0));
    }

    #[test]
    fn what_has_waited_too_long_gives_way_to_a_newer_frame_of_its_agent_and_the_last_one_never() {
        let mut shares = shares(QueueLimits::DEFAULT);
        let at = |ms: i64| AT + Span::from_millis(ms);
        for k in 0..6_u32 {
            shares.push((agent("a"), at(100 * i64::from(k))), 100, ("a", k));
        }
        shares.push((agent("b"), at(0)), 100, ("b", 0));
        assert_eq!(shares.pop(at(550)), Some(("a", 5)));
        assert_eq!((shares.dropped_total, shares.pop(at(10_000))), (5, Some(("b", 0))));
    }

    #[test]
    fn a_hub_that_was_held_up_for_a_moment_loses_nothing() {
        let mut shares = shares(QueueLimits::DEFAULT);
        let at = |ms: i64| AT + Span::from_millis(ms);
        let mut served = 0;
        // Ten frames a second of each agent, and a hub that stands still for 0.3 s of each second.
        for tick in 0..50_i64 {
            (0..20).for_each(|k| shares.push((agent(&format!("a{k}")), at(100 * tick)), 100, ("", k)));
            if tick % 10 > 2 {
                served += std::iter::from_fn(|| shares.pop(at(100 * tick + 50))).count();
            }
        }
        assert_eq!((served, shares.dropped_total), (1000, 0));
    }
}
