//! The agents: their names by number, what they declare of their sensors, and what is counted of them.

use super::description_bytes;
use super::processes::Processes;
use super::refusal::Refusal;
use super::statistics::AgentStatistics;
use crate::values::{AgentNames, AgentSlot, Coverage, SensorModel};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::AgentHealth;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};

/// Most agents of a hub.
pub const MAX_AGENTS: usize = 1024;
/// Most frames of one agent within Δmax.
pub const MAX_FRAMES_WITHIN_DELTA_MAX: usize = 4096;
/// How long an agent must have been silent before it makes room for another one.
const SILENT_FOR_GOOD: Span = Span::from_millis(60_000);

/// A clock that is set back is noticed this often at most: what it claimed is then taken back, which costs a replay.
const SET_BACK_AT_MOST_EVERY: Span = Span::from_millis(1000);

/// A frame this far in the future was not overtaken on its way, but its agent's clock is wrong.
const FAR_AHEAD: Span = Span::from_millis(100);

/// What is known of one agent.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct AgentRecord {
    /// Its sensor description, once it has sent one.
    #[serde(with = "description_bytes")]
    pub description: Option<SensorDescription>,
    /// How its detections are read, by that.
    pub sensor: SensorModel,
    /// Capture time of its newest accepted frame.
    pub newest_captured_at: Option<Timestamp>,
    /// Boot epoch of its newest accepted frame.
    pub epoch: u64,
    /// What is counted of it.
    pub statistics: AgentStatistics,
    /// When anything of it last arrived, by the hub's clock.
    last_heard_at: Option<Timestamp>,
    /// The newest of its frames that were captured in the future by the hub's clock.
    ahead: Option<AheadFrame>,
    /// When its clock was last found to be set back.
    set_back_at: Option<Timestamp>,
    /// Which processes send under its name.
    processes: Processes,
    /// Epochs and sequence numbers of the frames within Δmax, in order, to recognise duplicates.
    accepted: VecDeque<((u64, u64), Timestamp)>,
}

impl AgentRecord {
    /// When anything of it last arrived, by the hub's clock.
    pub const fn last_heard_at(&self) -> Option<Timestamp> {
        self.last_heard_at
    }

    /// What a frame of it covers; `None` where that is not known.
    pub fn coverage(&self, frame: &DetectionFrame) -> Option<Coverage> {
        Some(self.sensor.coverage(self.description.as_ref()?, frame.sensor_pose?))
    }

    /// Whether a frame of it has been accepted before, and was captured after the horizon. An older one does not count: whoever has
    /// used numbers that are yet to come (a forger, or the agent before it was restarted) silences nobody for longer.
    pub(super) fn has_accepted(&self, frame: &FrameId, horizon: Timestamp) -> bool {
        let place = self.accepted.binary_search_by_key(&(frame.epoch, frame.sequence), |(id, _)| *id);
        place.is_ok_and(|place| self.accepted[place].1 >= horizon)
    }

    /// The epoch of the process that holds its name, where a frame of another one is held off.
    pub(super) fn holds_off(&self, frame: &DetectionFrame, now: Timestamp) -> Option<u64> {
        self.processes.holds_off(frame, now)
    }

    /// Whether there is no room for another frame within Δmax, which began at `horizon`.
    pub(super) fn is_full(&self, horizon: Timestamp) -> bool {
        let full = self.accepted.len() >= MAX_FRAMES_WITHIN_DELTA_MAX;
        full && self.accepted.iter().all(|(_, captured_at)| *captured_at >= horizon)
    }

    /// Notes a frame that is accepted at `now`, and forgets those of before the horizon, which are too old to arrive again.
    pub(super) fn note_accepted(&mut self, frame: &DetectionFrame, horizon: Timestamp, now: Timestamp) {
        self.processes.note(frame, now);
        while self.accepted.front().is_some_and(|(_, captured_at)| *captured_at < horizon) {
            self.accepted.pop_front();
        }
        if self.accepted.len() >= MAX_FRAMES_WITHIN_DELTA_MAX {
            self.accepted.retain(|(_, captured_at)| *captured_at >= horizon);
        }
        let id = (frame.id.epoch, frame.id.sequence);
        match self.accepted.binary_search_by_key(&id, |(other, _)| *other) {
            Ok(place) => self.accepted[place].1 = frame.captured_at,
            Err(place) => self.accepted.insert(place, (id, frame.captured_at)),
        }
        if self.newest_captured_at.is_none_or(|newest| frame.captured_at >= newest) {
            self.newest_captured_at = Some(frame.captured_at);
            self.epoch = frame.id.epoch;
        }
    }

    /// Whether a frame shows that the agent's clock was ahead and has been set back: it was sent after one that is captured
    /// later by its stamp, which lay in the future when that arrived. That is noticed once a second at most.
    pub(super) fn is_set_back(&mut self, frame: &DetectionFrame, is_ahead: bool, now: Timestamp) -> bool {
        if is_ahead {
            let id = (frame.id.epoch, frame.id.sequence);
            if self.ahead.is_none_or(|newest| newest.id < id) {
                self.ahead =
                    Some(AheadFrame { id, captured_at: frame.captured_at, ahead: frame.captured_at - now });
            }
            return false;
        }
        let is_before = |newest: AheadFrame| frame.captured_at < newest.captured_at;
        let is_set_back = self.ahead.is_some_and(|newest| is_before(newest) && newest.is_followed_by(frame))
            && self.set_back_at.is_none_or(|before| now - before > SET_BACK_AT_MOST_EVERY);
        if is_set_back {
            self.ahead = None;
            self.set_back_at = Some(now);
        }
        is_set_back
    }

    /// Its entry in a fused frame.
    pub fn health(&self, agent: AgentId) -> AgentHealth {
        AgentHealth {
            agent,
            epoch: self.epoch,
            newest_captured_at: self.newest_captured_at.unwrap_or(Timestamp::EPOCH),
            accepted: self.statistics.accepted,
            refused: self.statistics.refused_total(),
            out_of_sequence: self.statistics.out_of_sequence,
        }
    }
}

/// A frame that was captured in the future by the hub's clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct AheadFrame {
    id: (u64, u64),
    captured_at: Timestamp,
    /// By how much.
    ahead: Span,
}

impl AheadFrame {
    /// Whether a frame that arrives after this one was sent after it, too. A sequence number that is the time of capture says
    /// nothing of that: then this one must have been far ahead, farther than frames overtake each other by.
    fn is_followed_by(&self, frame: &DetectionFrame) -> bool {
        let is_by_time = i64::try_from(frame.id.sequence).ok() == Some(frame.captured_at.as_micros());
        (frame.id.epoch, frame.id.sequence) > self.id || (is_by_time && self.ahead > FAR_AHEAD)
    }
}

/// All agents of a hub.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AgentRegistry {
    silent_for_good: Span,
    names: AgentNames,
    /// By slot.
    records: Vec<AgentRecord>,
    refused_beyond_limit: u64,
}

impl AgentRegistry {
    /// Without agents. A track may name an agent for `named_for` after its last detection.
    pub(super) fn new(named_for: Span) -> Self {
        Self {
            silent_for_good: SILENT_FOR_GOOD.max(named_for),
            names: AgentNames::default(),
            records: Vec::new(),
            refused_beyond_limit: 0,
        }
    }

    /// Names and slots.
    pub(super) const fn names(&self) -> &AgentNames {
        &self.names
    }

    /// The slot and the record of an agent.
    pub(super) fn entry(&self, agent: &AgentId) -> Option<(AgentSlot, &AgentRecord)> {
        let slot = self.names.slot(agent)?;
        Some((slot, &self.records[slot.index()]))
    }

    /// The record of an agent.
    pub fn record(&self, agent: &AgentId) -> Option<&AgentRecord> {
        Some(self.entry(agent)?.1)
    }

    /// Every agent with its record, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&AgentId, &AgentRecord)> {
        self.names.iter().map(|(name, slot)| (name, &self.records[slot.index()]))
    }

    /// Frames of agents beyond [`MAX_AGENTS`], which no record counts.
    pub const fn refused_beyond_limit(&self) -> u64 {
        self.refused_beyond_limit
    }

    /// Whether there is room for another agent at `now`.
    pub(super) fn has_room(&self, now: Timestamp) -> bool {
        self.names.len() < MAX_AGENTS || self.dispensable(now).is_some()
    }

    /// The slot and the record of an agent that something has arrived from at `now`, made where there is none yet;
    /// `None` beyond [`MAX_AGENTS`].
    pub(super) fn heard(&mut self, agent: AgentId, now: Timestamp) -> Option<(AgentSlot, &mut AgentRecord)> {
        let slot = self.slot_for(agent, now)?;
        let record = &mut self.records[slot.index()];
        record.last_heard_at = Some(now);
        Some((slot, record))
    }

    /// Counts what is not a frame of an agent for which there is no room.
    pub(super) const fn note_beyond_limit(&mut self) {
        self.refused_beyond_limit += 1;
    }

    /// Counts refusals for one reason.
    pub(super) fn note_refusals(&mut self, agent: AgentId, refusal: Refusal, count: u64, now: Timestamp) {
        match self.heard(agent, now) {
            Some((_, record)) => record.statistics.note_refusals(refusal, count),
            None => self.refused_beyond_limit += count,
        }
    }

    fn slot_for(&mut self, agent: AgentId, now: Timestamp) -> Option<AgentSlot> {
        if let Some(slot) = self.names.slot(&agent) {
            return Some(slot);
        }
        if self.names.len() >= MAX_AGENTS {
            let dispensable = self.dispensable(now)?;
            let slot = self.names.remove(&dispensable)?;
            self.records[slot.index()] = AgentRecord::default();
        }
        let slot = self.names.slot_for(agent);
        if self.records.len() <= slot.index() {
            self.records.resize_with(slot.index() + 1, AgentRecord::default);
        }
        Some(slot)
    }

    /// The agent that makes room for another one. Names of which no frame was ever accepted go first, and of these the ones that do
    /// not describe themselves; an agent whose frames are fused stays, unless it is silent for good.
    fn dispensable(&self, now: Timestamp) -> Option<AgentId> {
        let usefulness =
            |record: &AgentRecord| (record.statistics.accepted > 0, record.description.is_some());
        let (agent, record) =
            self.iter().min_by_key(|(_, record)| (usefulness(record), record.last_heard_at))?;
        let last_heard_at = record.last_heard_at.unwrap_or(Timestamp::MIN);
        let is_dispensable = record.statistics.accepted == 0 || now - last_heard_at > self.silent_for_good;
        is_dispensable.then_some(*agent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(sequence: u64, ms: i64) -> DetectionFrame {
        let epoch = if sequence < 1000 { sequence / 100 } else { 0 };
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch, sequence };
        DetectionFrame::empty(id, at(ms))
    }

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    #[test]
    fn duplicates_are_recognised_in_any_order_until_they_are_too_old() {
        let mut record = AgentRecord::default();
        for (sequence, ms) in [(5, 50), (3, 30), (9, 90), (4, 40)] {
            record.note_accepted(&frame(sequence, ms), at(0), at(ms));
        }
        let has = |record: &AgentRecord, sequence| record.has_accepted(&frame(sequence, 0).id, at(0));
        assert!([3, 4, 5, 9].iter().all(|sequence| has(&record, *sequence)) && !has(&record, 6));
        // A frame of exactly the horizon may arrive again, an older one may not.
        record.note_accepted(&frame(10, 100), at(40), at(100));
        assert_eq!([3, 4, 5, 9, 10].map(|sequence| has(&record, sequence)), [false, true, true, true, true]);
    }

    #[test]
    fn a_clock_is_set_back_where_a_later_frame_is_of_before_one_of_the_future() {
        let mut record = AgentRecord::default();
        // Sequence number, stamp, arrival: 400 ms ahead, then right.
        let mut set_back =
            |sequence: u64, ms: i64, now: i64| record.is_set_back(&frame(sequence, ms), ms > now, at(now));
        assert!(!set_back(1, 500, 100) && !set_back(2, 600, 200));
        // One that was overtaken on the way shows nothing.
        assert!(!set_back(0, 400, 450));
        assert!(set_back(3, 300, 301) && !set_back(4, 400, 401));
        assert!(!set_back(5, 900, 501) && !set_back(6, 600, 601), "twice within a second");
        // Without sequence numbers of its own.
        let mut record = AgentRecord::default();
        let mut set_back = |ms: i64, now: i64| {
            let sequence = u64::try_from(at(ms).as_micros()).unwrap();
            record.is_set_back(&frame(sequence, ms), ms > now, at(now))
        };
        assert!(!set_back(520, 500) && !set_back(420, 530), "overtaken");
        assert!(!set_back(1000, 600) && set_back(700, 701));
        // A link that was slow and is fast again is no clock.
        let mut record = AgentRecord::default();
        let mut set_back =
            |sequence: u64, ms: i64, now: i64| record.is_set_back(&frame(sequence, ms), ms > now, at(now));
        assert!(!set_back(1, 100, 500) && !set_back(2, 200, 510) && !set_back(3, 300, 305));
    }

    #[test]
    fn health_is_of_the_newest_frame_by_capture_time() {
        let mut record = AgentRecord::default();
        for (sequence, ms) in [(100, 10), (300, 30), (200, 20)] {
            record.note_accepted(&frame(sequence, ms), at(0), at(ms));
        }
        let health = record.health(AgentId::new("a").unwrap());
        assert_eq!((health.newest_captured_at, health.epoch), (at(30), 3));
    }

    #[test]
    fn a_full_record_makes_room_by_what_is_too_old_wherever_it_stands() {
        let mut record = AgentRecord::default();
        record.note_accepted(&frame(0, 1000), at(0), at(1000));
        for sequence in 1..MAX_FRAMES_WITHIN_DELTA_MAX as u64 {
            record.note_accepted(&frame(sequence, 0), at(0), at(1000));
        }
        assert!(record.is_full(at(0)) && !record.is_full(at(500)));
        record.note_accepted(&frame(1 << 20, 1000), at(500), at(1000));
        assert_eq!(record.accepted.len(), 2);
    }
}
