//! What is let in, and the books on every agent.

use crate::agents::{AgentSlot, Agents};
use crate::config::EngineConfig;
use crate::refusal::Refusal;
use crate::sensing::{Look, Sensing};
use crate::track::LateData;
use std::collections::{BTreeMap, VecDeque};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::AgentHealth;
use v2x_common::id::{AgentId, MapFrame};
use v2x_common::sensor::SensorDescription;
use v2x_common::time::{Span, Timestamp};

/// Most agents that a hub keeps books on.
pub const MAX_AGENTS: usize = 1024;
/// How long an agent must have been silent before its books make room for a newcomer's.
const SILENT_FOR_GOOD: Span = Span::from_millis(60_000);
/// Most frames of one agent within Δmax.
pub const MAX_FRAMES_WITHIN_DELTA_MAX: usize = 4096;

/// What is known of one agent.
#[derive(Clone, Debug, Default)]
pub struct AgentRecord {
    /// Its sensor description, once it has sent one.
    pub description: Option<SensorDescription>,
    /// What follows from it for its reports.
    pub sensing: Sensing,
    /// Capture time of its newest accepted frame.
    pub newest_captured_at: Option<Timestamp>,
    /// Boot epoch of its newest accepted frame.
    pub epoch: u64,
    /// Frames accepted.
    pub accepted: u64,
    /// Frames accepted that were measured within ε_s of the newest accepted before.
    pub synchronous: u64,
    /// Frames accepted that were older than the newest accepted before by more than ε_s.
    pub out_of_sequence: u64,
    /// Frames accepted that were measured in the future by the hub's clock.
    pub ahead_of_time: u64,
    /// Frames refused, by reason.
    pub refused: BTreeMap<&'static str, u64>,
    /// The newest refusal.
    pub last_refusal: Option<Refusal>,
    /// Detections whose class name was not known.
    pub unmapped_classes: u64,
    /// Sensor descriptions refused.
    pub descriptions_refused: u64,
    /// When anything of it last came, by the hub's clock.
    last_heard_at: Option<Timestamp>,
    /// Sum of the normalised innovations squared of its associated positions, 2 degrees of freedom each.
    pub nis_sum: f64,
    /// How many these are.
    pub nis_count: u64,
    /// Epochs and numbers of the frames within Δmax, in order, to know duplicates by.
    seen: VecDeque<((u64, u64), Timestamp)>,
}

impl AgentRecord {
    /// Frames refused, for any reason.
    pub fn refused_total(&self) -> u64 {
        self.refused.values().sum()
    }

    /// Mean normalised innovation squared of its positions for each degree of freedom: 1 where the agent's
    /// reported covariance and the tracks' are honest, more where it claims to be better than it is. Only what
    /// is within the gate is associated and counted, so even honest agents stay slightly below.
    pub fn nis_per_dof(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "counts below 2^53")]
        (self.nis_count > 0).then(|| self.nis_sum / (2.0 * self.nis_count as f64))
    }

    /// What a frame of it says of objects that it does not report; `None` where nothing.
    pub fn look(&self, frame: &DetectionFrame) -> Option<Look> {
        Some(self.sensing.look(self.description.as_ref()?, frame.sensor_pose?))
    }

    fn has_seen(&self, frame: (u64, u64)) -> bool {
        self.seen.binary_search_by_key(&frame, |(id, _)| *id).is_ok()
    }

    /// Notes a frame, and forgets those that are too old to come again.
    fn note_seen(&mut self, frame: (u64, u64), captured_at: Timestamp, horizon: Timestamp) {
        while self.seen.front().is_some_and(|(_, captured_at)| *captured_at < horizon) {
            self.seen.pop_front();
        }
        if self.seen.len() >= MAX_FRAMES_WITHIN_DELTA_MAX {
            self.seen.retain(|(_, captured_at)| *captured_at >= horizon);
        }
        let place = self.seen.partition_point(|(id, _)| *id < frame);
        self.seen.insert(place, (frame, captured_at));
    }

    /// What a fused frame tells of it.
    pub fn health(&self, agent: AgentId) -> AgentHealth {
        AgentHealth {
            agent,
            epoch: self.epoch,
            newest_captured_at: self.newest_captured_at.unwrap_or(Timestamp::EPOCH),
            accepted: self.accepted,
            refused: self.refused_total(),
            out_of_sequence: self.out_of_sequence,
        }
    }
}

/// Admission: one place where a frame is accepted or refused, and counted.
#[derive(Clone, Debug)]
pub struct Inbox {
    delta_max: Span,
    synchronous: Span,
    late_data: LateData,
    silent_for_good: Span,
    map_frame: Option<MapFrame>,
    agents: Agents,
    /// By slot.
    records: Vec<AgentRecord>,
    newest_captured_at: Option<Timestamp>,
    refused_beyond_limit: u64,
    /// The hub's clock, as far as it was told.
    now: Timestamp,
    /// What was captured before is refused, for lack of room.
    history_begins: Timestamp,
}

impl Inbox {
    /// Of an engine with this configuration.
    pub fn new(config: &EngineConfig) -> Self {
        // A track may name an agent for as long as it is published and late data may revive it.
        let named_for = config.coast + config.delta_max + config.memory();
        Self {
            delta_max: config.delta_max,
            synchronous: config.synchronous,
            late_data: config.late_data,
            silent_for_good: SILENT_FOR_GOOD.max(named_for),
            map_frame: config.map_frame,
            agents: Agents::default(),
            records: Vec::new(),
            newest_captured_at: None,
            refused_beyond_limit: 0,
            now: Timestamp::MIN,
            history_begins: Timestamp::MIN,
        }
    }

    /// Notes a frame that is let in; `now` is the hub's clock. True where it is out of sequence.
    pub fn admit(&mut self, frame: &DetectionFrame, now: Timestamp) -> bool {
        self.tell_time(now);
        let newer_by = self.newest_captured_at.map_or(Span::ZERO, |newest| frame.captured_at - newest);
        let is_synchronous = newer_by.abs() <= self.synchronous;
        let out_of_sequence = newer_by < Span::ZERO && !is_synchronous;
        self.newest_captured_at = self.newest_captured_at.max(Some(frame.captured_at));
        // The first map frame that is named is the hub's, where it has none of its own.
        self.map_frame = self.map_frame.or(frame.map_frame);
        let horizon = now - self.delta_max;
        let Some(slot) = self.slot_for(frame.id.agent) else { return out_of_sequence };
        let record = &mut self.records[slot.index()];
        record.last_heard_at = Some(now);
        record.note_seen((frame.id.epoch, frame.id.sequence), frame.captured_at, horizon);
        if record.newest_captured_at.is_none_or(|newest| frame.captured_at >= newest) {
            record.newest_captured_at = Some(frame.captured_at);
            record.epoch = frame.id.epoch;
        }
        record.accepted += 1;
        record.synchronous += u64::from(is_synchronous);
        record.out_of_sequence += u64::from(out_of_sequence);
        record.ahead_of_time += u64::from(frame.captured_at > now);
        out_of_sequence
    }

    /// Tells the hub's clock, which never runs backwards.
    pub fn tell_time(&mut self, now: Timestamp) {
        self.now = self.now.max(now);
    }

    /// The coordinate frame of all positions, once there is one.
    pub fn map_frame(&self) -> Option<MapFrame> {
        self.map_frame
    }

    /// Shortens history: what was captured before is refused from now on.
    pub fn begin_history_at(&mut self, at: Timestamp) {
        self.history_begins = self.history_begins.max(at);
    }

    /// Nothing captured before this is let in.
    pub fn horizon(&self) -> Timestamp {
        (self.now - self.delta_max).max(self.history_begins)
    }

    /// What was captured within this time, at least Δmax, is remembered; nothing that was captured before.
    pub fn history_begins(&self, memory: Span) -> Timestamp {
        (self.now - memory).max(self.history_begins)
    }

    /// Whether a frame may be let in; `now` is the hub's clock.
    pub fn examine(&self, frame: &DetectionFrame, now: Timestamp) -> Result<(), Refusal> {
        if let (Some(theirs), Some(hub)) = (frame.map_frame, self.map_frame)
            && theirs != hub
        {
            return Err(Refusal::MapFrameMismatch { frame: theirs, hub });
        }
        let age = now - frame.captured_at;
        if age > self.delta_max {
            return Err(Refusal::TooLate { age });
        }
        if age < -self.delta_max {
            return Err(Refusal::TooEarly { ahead: -age });
        }
        if frame.captured_at < self.history_begins {
            return Err(Refusal::Overloaded { age });
        }
        let behind = self.newest_captured_at.map_or(Span::ZERO, |newest| newest - frame.captured_at);
        if self.late_data == LateData::Drop && behind > self.synchronous {
            return Err(Refusal::OutOfSequence { behind });
        }
        let Some(slot) = self.agents.slot(&frame.id.agent) else {
            let limit = MAX_AGENTS;
            let has_room = self.agents.len() < limit || self.longest_silent().is_some();
            return if has_room { Ok(()) } else { Err(Refusal::TooManyAgents { limit }) };
        };
        let record = &self.records[slot.index()];
        let (epoch, sequence) = (frame.id.epoch, frame.id.sequence);
        if record.has_seen((epoch, sequence)) {
            return Err(Refusal::Duplicate { epoch, sequence });
        }
        let horizon = now - self.delta_max;
        let full = record.seen.len() >= MAX_FRAMES_WITHIN_DELTA_MAX;
        if full && record.seen.iter().all(|(_, captured_at)| *captured_at >= horizon) {
            return Err(Refusal::TooManyFrames { limit: MAX_FRAMES_WITHIN_DELTA_MAX });
        }
        Ok(())
    }

    /// Counts a refusal, also one that was decided before the frame was a frame.
    pub fn refuse(&mut self, agent: AgentId, refusal: Refusal) {
        if let Some(record) = self.record_mut(agent) {
            *record.refused.entry(refusal.reason()).or_default() += 1;
            record.last_refusal = Some(refusal);
        } else {
            self.refused_beyond_limit += 1;
        }
    }

    /// The record of an agent, made where there is none yet; `None` beyond [`MAX_AGENTS`].
    pub fn record_mut(&mut self, agent: AgentId) -> Option<&mut AgentRecord> {
        let slot = self.slot_for(agent)?;
        let record = &mut self.records[slot.index()];
        record.last_heard_at = Some(self.now);
        Some(record)
    }

    /// The slot of an agent, given to it now where it has none; `None` beyond [`MAX_AGENTS`].
    fn slot_for(&mut self, agent: AgentId) -> Option<AgentSlot> {
        if let Some(slot) = self.agents.slot(&agent) {
            return Some(slot);
        }
        if self.agents.len() >= MAX_AGENTS {
            let gone = self.longest_silent()?;
            let slot = self.agents.remove(&gone)?;
            self.records[slot.index()] = AgentRecord::default();
        }
        let slot = self.agents.slot_for(agent);
        if self.records.len() <= slot.index() {
            self.records.resize_with(slot.index() + 1, AgentRecord::default);
        }
        Some(slot)
    }

    /// The agent that was silent for the longest time, if that is for good.
    fn longest_silent(&self) -> Option<AgentId> {
        let (agent, record) = self.agents().min_by_key(|(_, record)| record.last_heard_at)?;
        let last_heard_at = record.last_heard_at.unwrap_or(Timestamp::MIN);
        (self.now - last_heard_at > self.silent_for_good).then_some(*agent)
    }

    /// The record of an agent.
    pub fn record(&self, agent: &AgentId) -> Option<&AgentRecord> {
        Some(&self.records[self.agents.slot(agent)?.index()])
    }

    /// The slot and the record of an agent.
    pub(crate) fn entry(&self, agent: &AgentId) -> Option<(AgentSlot, &AgentRecord)> {
        let slot = self.agents.slot(agent)?;
        Some((slot, &self.records[slot.index()]))
    }

    /// Every agent with its record, by name.
    pub fn agents(&self) -> impl Iterator<Item = (&AgentId, &AgentRecord)> {
        self.agents.iter().map(|(name, slot)| (name, &self.records[slot.index()]))
    }

    /// Names and slots.
    pub(crate) fn names(&self) -> &Agents {
        &self.agents
    }

    /// Frames of agents beyond [`MAX_AGENTS`], which no record counts.
    pub fn refused_beyond_limit(&self) -> u64 {
        self.refused_beyond_limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::{FrameId, HubId};

    fn frame(agent: &str, sequence: u64, captured_ms: i64) -> DetectionFrame {
        DetectionFrame {
            id: FrameId { agent: AgentId::new(agent).unwrap(), epoch: 1, sequence },
            captured_at: at(captured_ms),
            sensor_pose: None,
            sensor_revision: 0,
            map_frame: None,
            detections: Vec::new(),
        }
    }

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(1_000_000 + ms)
    }

    /// As the engine does it.
    fn admit(inbox: &mut Inbox, frame: &DetectionFrame, now: Timestamp) -> Result<bool, Refusal> {
        inbox.tell_time(now);
        match inbox.examine(frame, now) {
            Ok(()) => Ok(inbox.admit(frame, now)),
            Err(refusal) => {
                inbox.refuse(frame.id.agent, refusal.clone());
                Err(refusal)
            }
        }
    }

    fn config() -> EngineConfig {
        EngineConfig::new(HubId::new("hub").unwrap(), 1)
    }

    fn inbox() -> Inbox {
        Inbox::new(&config())
    }

    #[test]
    fn age_is_measured_against_the_hubs_clock_at_both_ends() {
        let mut inbox = inbox();
        assert_eq!(admit(&mut inbox, &frame("a", 0, 0), at(500)), Ok(false));
        assert!(matches!(admit(&mut inbox, &frame("a", 1, 0), at(501)), Err(Refusal::TooLate { .. })));
        assert_eq!(admit(&mut inbox, &frame("a", 2, 1001), at(501)), Ok(false));
        assert!(matches!(admit(&mut inbox, &frame("a", 3, 1002), at(501)), Err(Refusal::TooEarly { .. })));
        let record = inbox.record(&AgentId::new("a").unwrap()).unwrap();
        assert_eq!((record.accepted, record.refused["too_late"], record.refused["too_early"]), (2, 1, 1));
    }

    #[test]
    fn a_frame_is_taken_once_and_again_only_in_a_new_epoch() {
        let mut inbox = inbox();
        assert_eq!(admit(&mut inbox, &frame("a", 7, 0), at(10)), Ok(false));
        assert!(matches!(admit(&mut inbox, &frame("a", 7, 0), at(10)), Err(Refusal::Duplicate { .. })));
        let mut rebooted = frame("a", 7, 20);
        rebooted.id.epoch = 2;
        assert_eq!(admit(&mut inbox, &rebooted, at(30)), Ok(false));
        assert_eq!(admit(&mut inbox, &frame("b", 7, 0), at(30)), Ok(true));
    }

    #[test]
    fn another_map_frame_is_refused_by_name() {
        let map_frame = Some(MapFrame::new("EPSG:32632").unwrap());
        let mut inbox = Inbox::new(&EngineConfig { map_frame, ..config() });
        let mut foreign = frame("a", 0, 0);
        foreign.map_frame = Some(MapFrame::new("EPSG:25833").unwrap());
        let message = admit(&mut inbox, &foreign, at(0)).unwrap_err().to_string();
        assert!(message.contains("EPSG:25833") && message.contains("EPSG:32632"), "{message}");
        assert_eq!(admit(&mut inbox, &frame("a", 1, 0), at(0)), Ok(false));
    }

    #[test]
    fn the_first_named_map_frame_holds_where_the_hub_names_none() {
        let named = |name: &str, sequence| {
            let mut frame = frame("a", sequence, 0);
            frame.map_frame = Some(MapFrame::new(name).unwrap());
            frame
        };
        let mut inbox = inbox();
        assert_eq!(admit(&mut inbox, &named("EPSG:32632", 0), at(0)), Ok(false));
        assert!(matches!(
            admit(&mut inbox, &named("EPSG:25833", 1), at(0)),
            Err(Refusal::MapFrameMismatch { .. })
        ));
        assert_eq!(inbox.map_frame(), Some(MapFrame::new("EPSG:32632").unwrap()));
    }

    #[test]
    fn an_agent_that_is_silent_for_good_makes_room_for_a_new_one() {
        let mut inbox = inbox();
        for agent in 0..MAX_AGENTS {
            admit(&mut inbox, &frame(&format!("a{agent}"), 0, 0), at(0)).unwrap();
        }
        assert!(matches!(
            admit(&mut inbox, &frame("z", 0, 50_000), at(50_000)),
            Err(Refusal::TooManyAgents { .. })
        ));
        assert_eq!(admit(&mut inbox, &frame("z", 1, 61_000), at(61_000)), Ok(false));
        assert_eq!(inbox.agents().count(), MAX_AGENTS);
    }

    #[test]
    fn memory_is_bounded_against_many_agents_and_many_frames() {
        let mut inbox = inbox();
        for agent in 0..MAX_AGENTS {
            admit(&mut inbox, &frame(&format!("a{agent}"), 0, 0), at(0)).unwrap();
        }
        assert!(matches!(admit(&mut inbox, &frame("z", 0, 0), at(0)), Err(Refusal::TooManyAgents { .. })));
        assert_eq!(inbox.refused_beyond_limit(), 1);
        for sequence in 1..MAX_FRAMES_WITHIN_DELTA_MAX as u64 {
            admit(&mut inbox, &frame("a0", sequence, 0), at(0)).unwrap();
        }
        let one_more = frame("a0", 1 << 40, 0);
        assert!(matches!(admit(&mut inbox, &one_more, at(0)), Err(Refusal::TooManyFrames { .. })));
        let later = frame("a0", 1 << 41, 600);
        assert_eq!(admit(&mut inbox, &later, at(600)), Ok(false), "room again once Δmax has passed");
    }
}
