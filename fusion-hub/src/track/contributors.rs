//! The newest detection of a track by each agent.

use super::evidence::Evidence;
use super::frame_store::StoredFrame;
use crate::values::{AgentNames, AgentSlot};
use serde::{Deserialize, Serialize};
use v2x_common::id::{FrameId, MeasurementId};
use v2x_common::time::Timestamp;

/// An agent's newest detection of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Contributor {
    captured_at: Timestamp,
    epoch: u64,
    sequence: u64,
    index: u16,
    agent: AgentSlot,
}

impl Contributor {
    /// The agent.
    pub const fn agent(&self) -> AgentSlot {
        self.agent
    }

    /// When it was captured.
    pub const fn captured_at(&self) -> Timestamp {
        self.captured_at
    }

    /// The detection.
    pub fn measurement(&self, agents: &AgentNames) -> MeasurementId {
        let frame = FrameId { agent: agents.name(self.agent), epoch: self.epoch, sequence: self.sequence };
        MeasurementId { frame, index: self.index }
    }
}

/// Room for agents in a new track.
const AGENTS_AT_FIRST: usize = 16;

/// The newest detection of each agent, in the order of the agents' names.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Contributors {
    newest: Vec<Contributor>,
    last_measured_at: Option<Timestamp>,
    /// None of them is older: saves a search for older ones.
    none_before: Timestamp,
}

impl Default for Contributors {
    fn default() -> Self {
        Self {
            newest: Vec::with_capacity(AGENTS_AT_FIRST),
            last_measured_at: None,
            none_before: Timestamp::MAX,
        }
    }
}

impl Contributors {
    /// None, without allocated memory.
    pub const NONE: Self = Self { newest: Vec::new(), last_measured_at: None, none_before: Timestamp::MAX };

    /// Notes a detection.
    #[inline]
    pub fn note(&mut self, evidence: &Evidence, frame: &StoredFrame, agents: &AgentNames) {
        let entry = Contributor {
            captured_at: evidence.captured_at,
            epoch: frame.id.epoch,
            sequence: frame.id.sequence,
            index: evidence.index(),
            agent: frame.agent,
        };
        self.add(entry, agents);
    }

    /// Notes those of another list that are not after a time.
    pub fn note_until(&mut self, at: Timestamp, others: &Self, agents: &AgentNames) {
        for entry in others.newest.iter().filter(|entry| entry.captured_at <= at) {
            self.add(*entry, agents);
        }
    }

    #[inline]
    fn add(&mut self, entry: Contributor, agents: &AgentNames) {
        self.last_measured_at = self.last_measured_at.max(Some(entry.captured_at));
        self.none_before = self.none_before.min(entry.captured_at);
        let rank = agents.rank_of(entry.agent);
        // Where every agent detects the object, each stands at its rank.
        if let Some(known) = self.newest.get_mut(usize::from(rank))
            && known.agent == entry.agent
        {
            *known = (*known).max(entry);
            return;
        }
        match self.newest.binary_search_by_key(&rank, |known| agents.rank_of(known.agent)) {
            Ok(place) => self.newest[place] = self.newest[place].max(entry),
            Err(place) => self.newest.insert(place, entry),
        }
    }

    /// The newest of all; of several at the same time that of the first agent by name.
    pub fn newest(&self) -> Option<&Contributor> {
        self.newest.iter().rev().max_by_key(|known| known.captured_at)
    }

    /// Capture time of the newest.
    pub fn last_measured_at(&self) -> Timestamp {
        self.last_measured_at.unwrap_or(Timestamp::MIN)
    }

    /// Forgets those older than `oldest`, except the newest.
    pub fn forget_before(&mut self, oldest: Timestamp) {
        if self.none_before >= oldest {
            return;
        }
        let newest = self.last_measured_at();
        self.newest.retain(|known| known.captured_at >= oldest || known.captured_at == newest);
        let times = self.newest.iter().map(|known| known.captured_at);
        self.none_before = times.min().unwrap_or(Timestamp::MAX);
    }

    /// Forgets those after a time.
    pub fn forget_after(&mut self, newest: Timestamp) {
        self.newest.retain(|known| known.captured_at <= newest);
        self.last_measured_at = self.newest.iter().map(|known| known.captured_at).max();
    }

    /// Forgets that of an agent.
    pub fn forget_agent(&mut self, agent: AgentSlot) {
        self.newest.retain(|known| known.agent != agent);
        self.last_measured_at = self.newest.iter().map(|known| known.captured_at).max();
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.newest.clear();
        self.last_measured_at = None;
        self.none_before = Timestamp::MAX;
    }

    /// Every contributor, by name.
    pub fn iter(&self) -> impl Iterator<Item = &Contributor> {
        self.newest.iter()
    }
}
