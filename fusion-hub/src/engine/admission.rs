//! Admission: the one place where it is decided whether a frame is taken.

use super::agents::{AgentRegistry, MAX_AGENTS, MAX_FRAMES_WITHIN_DELTA_MAX};
use super::config::EngineConfig;
use super::history::History;
use super::map_frames::MapFrames;
use super::refusal::{Refusal, StampFault};
use crate::fusion::LateFrames;
use serde::{Deserialize, Serialize};
use v2x_common::detection::DetectionFrame;
use v2x_common::id::MapFrame;
use v2x_common::time::{Span, Timestamp};

/// Decides on frames.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Admission {
    delta_max: Span,
    synchronous: Span,
    late_frames: LateFrames,
    map_frames: MapFrames,
    /// How far the clock of the hub's system is ahead of the hub's timeline, since it was set.
    pub(super) clock_step: Span,
    /// The newest capture time of an admitted frame. Frames that were captured in the future by the hub's clock do not
    /// count: one agent whose clock is ahead would make the frames of all others late.
    newest_captured_at: Option<Timestamp>,
}

/// An admitted frame, compared with the newest one before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Admitted {
    /// It was captured within ε_s of it.
    pub(super) is_synchronous: bool,
    /// It was captured before it by more than ε_s.
    pub(super) out_of_sequence: bool,
    /// It was captured in the future by the hub's clock.
    pub(super) ahead_of_time: bool,
}

impl Admission {
    pub(super) const fn new(config: &EngineConfig) -> Self {
        Self {
            delta_max: config.delta_max,
            synchronous: config.synchronous,
            late_frames: config.late_frames,
            map_frames: MapFrames::new(config.map_frame),
            clock_step: Span::ZERO,
            newest_captured_at: None,
        }
    }

    /// The coordinate frame of all positions, once there is one.
    pub(super) const fn map_frame(&self) -> Option<MapFrame> {
        self.map_frames.current()
    }

    /// Takes note of the map frame that a frame names, whether it is admitted or not.
    pub(super) fn note_map_frame(&mut self, frame: &DetectionFrame, now: Timestamp) {
        if let Some(name) = frame.map_frame
            && (now - frame.captured_at).abs() <= self.delta_max
        {
            self.map_frames.note(frame.id.agent, name, now);
        }
    }

    /// What is to be added to a stamp, so that it is by the hub's timeline: nothing, unless the stamp is impossible by it and
    /// possible by the system's clock, which was set.
    pub(super) fn shift_of(&self, captured_at: Timestamp, now: Timestamp) -> Span {
        let is_possible = |by: Timestamp| (by - captured_at).abs() <= self.delta_max;
        let is_stepped = !is_possible(now) && is_possible(now + self.clock_step);
        if is_stepped { -self.clock_step } else { Span::ZERO }
    }

    /// Decides on a frame that arrives at `now`. Nothing changes.
    pub(super) fn admit(
        &self,
        frame: &DetectionFrame,
        now: Timestamp,
        agents: &AgentRegistry,
        history: &History,
    ) -> Result<Admitted, Refusal> {
        self.check_map_frame(frame)?;
        self.check_time(frame, now, history)?;
        self.check_agent(frame, now, agents)?;
        let newer_by = self.newest_captured_at.map_or(Span::ZERO, |newest| frame.captured_at - newest);
        let is_synchronous = newer_by.abs() <= self.synchronous;
        Ok(Admitted {
            is_synchronous,
            out_of_sequence: newer_by < Span::ZERO && !is_synchronous,
            ahead_of_time: frame.captured_at > now,
        })
    }

    /// Takes note of a frame that was admitted.
    pub(super) fn note(&mut self, frame: &DetectionFrame, now: Timestamp) {
        if frame.captured_at <= now + self.synchronous {
            self.newest_captured_at = self.newest_captured_at.max(Some(frame.captured_at));
        }
    }

    fn check_map_frame(&self, frame: &DetectionFrame) -> Result<(), Refusal> {
        match (frame.map_frame, self.map_frames.current()) {
            (Some(theirs), Some(hub)) if theirs != hub => {
                Err(Refusal::MapFrameMismatch { frame: theirs, hub })
            }
            _ => Ok(()),
        }
    }

    fn check_time(&self, frame: &DetectionFrame, now: Timestamp, history: &History) -> Result<(), Refusal> {
        let age = now - frame.captured_at;
        if age.abs() > self.delta_max
            && let Some(cause) = StampFault::of(frame.captured_at, now)
        {
            return Err(Refusal::WrongTimeUnit { off: -age, cause });
        }
        if age > self.delta_max {
            return Err(Refusal::TooLate { age });
        }
        if age < -self.delta_max {
            return Err(Refusal::TooEarly { ahead: -age });
        }
        if frame.captured_at < history.given_up_before() {
            return Err(Refusal::Overloaded { age });
        }
        let behind = self.newest_captured_at.map_or(Span::ZERO, |newest| newest - frame.captured_at);
        if self.late_frames == LateFrames::Drop && behind > self.synchronous {
            return Err(Refusal::OutOfSequence { behind });
        }
        Ok(())
    }

    fn check_agent(
        &self,
        frame: &DetectionFrame,
        now: Timestamp,
        agents: &AgentRegistry,
    ) -> Result<(), Refusal> {
        let Some(record) = agents.record(&frame.id.agent) else {
            let refusal = Refusal::TooManyAgents { limit: MAX_AGENTS };
            return if agents.has_room(now) { Ok(()) } else { Err(refusal) };
        };
        if record.has_accepted(&frame.id, now - self.delta_max) {
            return Err(Refusal::Duplicate { epoch: frame.id.epoch, sequence: frame.id.sequence });
        }
        if let Some(epoch) = record.holds_off(frame, now) {
            return Err(Refusal::HeldOff { epoch });
        }
        if record.is_full(now - self.delta_max) {
            return Err(Refusal::TooManyFrames { limit: MAX_FRAMES_WITHIN_DELTA_MAX });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::AgentSlot;
    use v2x_common::id::{AgentId, FrameId, HubId};

    #[test]
    fn what_is_older_than_the_history_given_up_is_refused_as_overloaded() {
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(1_000_000 + ms);
        let mut history = History::new(Span::from_millis(700), Span::from_millis(500));
        for k in 0..8 {
            history.note(AgentSlot::default(), at(k), 100);
        }
        history.give_up_quarter(at(8));
        let admission = Admission::new(&EngineConfig::new(HubId::new("hub").unwrap(), 1));
        let id = FrameId { agent: AgentId::new("a").unwrap(), epoch: 1, sequence: 1 };
        let check = |ms| admission.check_time(&DetectionFrame::empty(id, at(ms)), at(8), &history);
        assert_eq!(check(2), Ok(()));
        assert_eq!(check(1), Err(Refusal::Overloaded { age: Span::from_millis(7) }));
    }
}
