//! The horizon of history: what is held, for how long, and how much of it.
//!
//! It counts frames and measurements for every fusion method alike. Where frames come faster than they can be held, the
//! oldest quarter of history is given up: late frames as old as that are refused. No agent can fill the room alone.

use crate::track::Horizon;
use crate::values::AgentSlot;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use v2x_common::time::{Span, Timestamp};

/// Most frames held.
pub const MAX_FRAMES: usize = 1 << 16;
/// Most measurements held, in all frames.
pub const MAX_MEASUREMENTS: usize = 1 << 20;
/// Most of these that are of one agent.
pub const MAX_MEASUREMENTS_OF_AGENT: usize = MAX_MEASUREMENTS / 8;

/// A frame that is held.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Entry {
    captured_at: Timestamp,
    agent: AgentSlot,
    n_measurements: usize,
}

/// What is held of the past.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct History {
    memory: Span,
    delta_max: Span,
    /// What was captured earlier was given up for lack of room.
    given_up_before: Timestamp,
    /// By capture time.
    entries: VecDeque<Entry>,
    n_measurements: usize,
    /// By agent.
    n_measurements_of: Vec<usize>,
}

impl History {
    /// Reaches back for the memory; late frames may arrive within Δmax.
    pub(super) const fn new(memory: Span, delta_max: Span) -> Self {
        Self {
            memory,
            delta_max,
            given_up_before: Timestamp::MIN,
            entries: VecDeque::new(),
            n_measurements: 0,
            n_measurements_of: Vec::new(),
        }
    }

    /// What was captured earlier was given up for lack of room.
    pub(super) const fn given_up_before(&self) -> Timestamp {
        self.given_up_before
    }

    /// Nothing captured before this is admitted.
    pub(super) fn admits_from(&self, now: Timestamp) -> Timestamp {
        (now - self.delta_max).max(self.given_up_before)
    }

    /// What was captured from this time on is remembered.
    pub(super) fn begins(&self, now: Timestamp) -> Timestamp {
        (now - self.memory).max(self.given_up_before)
    }

    /// Whether an agent has no room for a frame with this many measurements.
    pub(super) fn is_full_of(&self, agent: AgentSlot, n_measurements: usize) -> bool {
        let held = self.n_measurements_of.get(agent.index()).copied().unwrap_or(0);
        held + n_measurements > MAX_MEASUREMENTS_OF_AGENT
    }

    /// Whether there is no room for a frame with this many measurements.
    pub(super) fn is_full_for(&self, n_measurements: usize) -> bool {
        self.entries.len() >= MAX_FRAMES || self.n_measurements + n_measurements > MAX_MEASUREMENTS
    }

    /// Gives up the oldest quarter, by frames and by measurements, but nothing after `now`.
    pub(super) fn give_up_quarter(&mut self, now: Timestamp) {
        let mut measurements = 0;
        let is_enough = |place: usize, measurements: usize| {
            4 * place >= self.entries.len() && 4 * measurements >= self.n_measurements
        };
        let begins = self.entries.iter().enumerate().find_map(|(place, entry)| {
            let found = is_enough(place, measurements).then_some(entry.captured_at);
            measurements += entry.n_measurements;
            found
        });
        if let Some(begins) = begins {
            self.given_up_before = self.given_up_before.max(begins.min(now));
        }
    }

    /// Counts a frame that is held from now on.
    pub(super) fn note(&mut self, agent: AgentSlot, captured_at: Timestamp, n_measurements: usize) {
        let place = self.entries.iter().rposition(|entry| entry.captured_at <= captured_at);
        self.entries.insert(place.map_or(0, |place| place + 1), Entry { captured_at, agent, n_measurements });
        self.n_measurements += n_measurements;
        if self.n_measurements_of.len() <= agent.index() {
            self.n_measurements_of.resize(agent.index() + 1, 0);
        }
        self.n_measurements_of[agent.index()] += n_measurements;
    }

    /// Forgets what is not held any more.
    pub(super) fn forget_before(&mut self, horizon: &Horizon) {
        let until = horizon.at - horizon.slack;
        while self.entries.front().is_some_and(|entry| entry.captured_at < until) {
            let Some(entry) = self.entries.pop_front() else { return };
            self.n_measurements -= entry.n_measurements;
            self.n_measurements_of[entry.agent.index()] -= entry.n_measurements;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    fn history() -> History {
        History::new(Span::from_millis(700), Span::from_millis(500))
    }

    #[test]
    fn history_reaches_back_for_the_memory_and_admits_for_delta_max() {
        let history = history();
        assert_eq!((history.begins(at(1000)), history.admits_from(at(1000))), (at(300), at(500)));
    }

    #[test]
    fn one_agent_fills_an_eighth_of_the_room_at_most() {
        let mut history = history();
        let agent = AgentSlot::default();
        history.note(agent, at(0), MAX_MEASUREMENTS_OF_AGENT - 1);
        assert!(!history.is_full_of(agent, 1) && history.is_full_of(agent, 2) && !history.is_full_for(2));
        let horizon = Horizon { at: at(2), slack: Span::from_millis(1) };
        history.forget_before(&horizon);
        assert!(!history.is_full_of(agent, MAX_MEASUREMENTS_OF_AGENT), "room again");
    }

    #[test]
    fn history_is_full_by_measurements_or_by_frames() {
        let mut history = history();
        history.note(AgentSlot::default(), at(0), MAX_MEASUREMENTS - 1);
        assert!(!history.is_full_for(1) && history.is_full_for(2));
        (1..MAX_FRAMES).for_each(|_| history.note(AgentSlot::default(), at(1), 0));
        assert!(history.is_full_for(0));
        let mut half = self::history();
        half.note(AgentSlot::default(), at(0), MAX_MEASUREMENTS / 2);
        assert!(!half.is_full_for(MAX_MEASUREMENTS / 2));
    }

    #[test]
    fn a_quarter_is_given_up_of_the_frames_and_of_the_measurements() {
        let mut history = history();
        for (k, n_measurements) in (0..).zip([0, 0, 0, 80, 10, 10, 10, 10]) {
            history.note(AgentSlot::default(), at(k), n_measurements);
        }
        history.give_up_quarter(at(8));
        assert_eq!(history.begins(at(8)), at(4));
    }

    #[test]
    fn what_is_within_the_slack_is_held() {
        let mut history = history();
        (0..4).for_each(|k| history.note(AgentSlot::default(), at(k), 1));
        history.forget_before(&Horizon { at: at(3), slack: Span::from_millis(2) });
        assert_eq!(history.entries.len(), 3);
    }

    #[test]
    fn the_oldest_quarter_is_given_up_and_forgotten() {
        let mut history = history();
        for k in 0..8 {
            history.note(AgentSlot::default(), at(k), 100);
        }
        history.give_up_quarter(at(8));
        assert_eq!(history.begins(at(8)), at(2), "two of eight frames");
        let horizon = Horizon { at: history.begins(at(8)), slack: Span::ZERO };
        history.forget_before(&horizon);
        assert_eq!((history.entries.len(), history.n_measurements), (6, 600));
    }

    #[test]
    fn nothing_after_the_present_is_given_up() {
        let mut history = history();
        history.note(AgentSlot::default(), at(900), MAX_MEASUREMENTS);
        history.note(AgentSlot::default(), at(950), 1);
        history.give_up_quarter(at(600));
        assert_eq!(history.begins(at(600)), at(600));
    }
}
