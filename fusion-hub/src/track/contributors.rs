//! Whose measurements a track holds.

use crate::agents::{AgentSlot, Agents};
use crate::frames::{Piece, StoredFrame};
use v2x_common::id::{FrameId, MeasurementId};
use v2x_common::time::Timestamp;

/// An agent's newest measurement of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Contributor {
    captured_at: Timestamp,
    epoch: u64,
    sequence: u64,
    index: u16,
    agent: AgentSlot,
}

impl Contributor {
    /// Which detection it was.
    pub fn measurement(&self, agents: &Agents) -> MeasurementId {
        let frame = FrameId { agent: agents.name(self.agent), epoch: self.epoch, sequence: self.sequence };
        MeasurementId { frame, index: self.index }
    }
}

/// Room for agents in a new track.
const AGENTS_AT_FIRST: usize = 16;

/// The newest measurement of each agent, by the agents' names.
#[derive(Clone, Debug)]
pub struct Contributors {
    newest: Vec<Contributor>,
    last_measured_at: Option<Timestamp>,
    /// None of them is older, so that nobody looks for such.
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
    /// Of nothing, without room.
    pub const NONE: Self = Self { newest: Vec::new(), last_measured_at: None, none_before: Timestamp::MAX };

    /// Notes a report.
    #[inline]
    pub fn note(&mut self, piece: &Piece, frame: &StoredFrame, agents: &Agents) {
        let entry = Contributor {
            captured_at: piece.captured_at,
            epoch: frame.id.epoch,
            sequence: frame.id.sequence,
            index: piece.index,
            agent: frame.agent,
        };
        self.add(entry, agents);
    }

    /// Notes what others note that is not after a time.
    pub fn note_until(&mut self, at: Timestamp, others: &Self, agents: &Agents) {
        for entry in others.newest.iter().filter(|entry| entry.captured_at <= at) {
            self.add(*entry, agents);
        }
    }

    #[inline]
    fn add(&mut self, entry: Contributor, agents: &Agents) {
        self.last_measured_at = self.last_measured_at.max(Some(entry.captured_at));
        self.none_before = self.none_before.min(entry.captured_at);
        let rank = agents.rank_of(entry.agent);
        // Where everybody sees everything, an agent stands at its rank.
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

    /// The newest of all; of several agents' at the same time the first one's by name, as wherever agents stand in a
    /// row.
    pub fn newest(&self) -> Option<&Contributor> {
        self.newest.iter().rev().max_by_key(|known| known.captured_at)
    }

    /// When any agent last measured it.
    pub fn last_measured_at(&self) -> Timestamp {
        self.last_measured_at.unwrap_or(Timestamp::MIN)
    }

    /// Forgets who has not measured it since `oldest`, but for the newest.
    pub fn forget_before(&mut self, oldest: Timestamp) {
        if self.none_before >= oldest {
            return;
        }
        let newest = self.last_measured_at();
        self.newest.retain(|known| known.captured_at >= oldest || known.captured_at == newest);
        let times = self.newest.iter().map(|known| known.captured_at);
        self.none_before = times.min().unwrap_or(Timestamp::MAX);
    }

    /// Forgets measurements made after a time.
    pub fn forget_after(&mut self, newest: Timestamp) {
        self.newest.retain(|known| known.captured_at <= newest);
        self.last_measured_at = self.newest.iter().map(|known| known.captured_at).max();
    }

    /// Forgets an agent's.
    pub fn take_back(&mut self, agent: AgentSlot) {
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
