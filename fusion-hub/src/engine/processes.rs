//! Two processes that send under one name.
//!
//! A process is known by its boot epoch. An agent that is started again has a new one, and is taken at once: frames of the old one
//! may still be on their way. But where the old one goes on with newer frames after those of the new one, again and again, both run:
//! then the first one is taken and the others are held off, as long as the first one sends. Without certificates nobody can know
//! which one is the right one; two of them in one record would be worse than either.

use serde::{Deserialize, Serialize};
use v2x_common::detection::DetectionFrame;
use v2x_common::time::{Span, Timestamp};

/// So often the first process has gone on after another one before that is held off.
const RETURNS: u32 = 3;
/// The first process holds the name for so long after its last frame.
const HELD_FOR: Span = Span::from_millis(1_000);

/// The processes of one name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Processes {
    holder: Option<Holder>,
    /// Newest capture time of a frame of another process, since the holder's last frame.
    other: Option<Timestamp>,
    returns: u32,
}

/// The process that was here first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Holder {
    epoch: u64,
    newest_captured_at: Timestamp,
    heard_at: Timestamp,
}

impl Processes {
    /// The epoch that holds the name, where a frame of another one is held off at `now`.
    pub(super) fn holds_off(&self, frame: &DetectionFrame, now: Timestamp) -> Option<u64> {
        let holder = self.holder.filter(|holder| holder.epoch != frame.id.epoch)?;
        (self.returns >= RETURNS && now - holder.heard_at < HELD_FOR).then_some(holder.epoch)
    }

    /// Notes a frame that is accepted at `now`.
    pub(super) fn note(&mut self, frame: &DetectionFrame, now: Timestamp) {
        let captured_at = frame.captured_at;
        match &mut self.holder {
            Some(holder) if holder.epoch == frame.id.epoch => {
                let goes_on = captured_at > holder.newest_captured_at;
                if goes_on && self.other.is_some_and(|other| captured_at > other) {
                    self.returns = self.returns.saturating_add(1);
                    self.other = None;
                }
                holder.newest_captured_at = holder.newest_captured_at.max(captured_at);
                holder.heard_at = now;
            }
            Some(holder) if now - holder.heard_at < HELD_FOR => {
                let is_newer = captured_at > holder.newest_captured_at;
                self.other = self.other.max(is_newer.then_some(captured_at));
            }
            // The first one, or the one before has ended.
            _ => {
                let holder = Holder { epoch: frame.id.epoch, newest_captured_at: captured_at, heard_at: now };
                *self = Self { holder: Some(holder), ..Self::default() };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::{AgentId, FrameId};

    fn at(ms: i64) -> Timestamp {
        Timestamp::EPOCH + Span::from_millis(ms)
    }

    /// Which of the frames (epoch, captured, arrival in ms) are taken.
    fn taken(frames: &[(u64, i64, i64)]) -> Vec<bool> {
        let mut processes = Processes::default();
        let mut take = |&(epoch, captured_ms, arrival_ms): &(u64, i64, i64)| {
            let id = FrameId { agent: AgentId::new("a").unwrap(), epoch, sequence: 0 };
            let frame = DetectionFrame::empty(id, at(captured_ms));
            let is_taken = processes.holds_off(&frame, at(arrival_ms)).is_none();
            if is_taken {
                processes.note(&frame, at(arrival_ms));
            }
            is_taken
        };
        frames.iter().map(&mut take).collect()
    }

    #[test]
    fn after_a_restart_an_agent_is_taken_at_once_also_while_old_frames_arrive() {
        let mut frames: Vec<_> = (0..20).map(|k| (1, 100 * k, 100 * k + 20)).collect();
        for k in 20..40 {
            frames.push((2, 100 * k, 100 * k + 20));
            // Half a second late.
            frames.push((1, 100 * k - 500, 100 * k + 25));
        }
        assert!(taken(&frames).iter().all(|taken| *taken));
    }

    #[test]
    fn a_second_process_of_one_name_is_a_fault_and_is_held_off_until_the_first_one_has_ended() {
        let both: Vec<_> =
            (0..30).flat_map(|k| [(1, 100 * k, 100 * k + 20), (2, 100 * k + 50, 100 * k + 70)]).collect();
        let found = taken(&both);
        assert!(found.chunks(2).all(|pair| pair[0]), "the first one is never refused");
        assert!(found.chunks(2).skip(4).all(|pair| !pair[1]), "{found:?}");
        // The first one ends at 3 s.
        let alone: Vec<_> = (30..60).map(|k| (2, 100 * k + 50, 100 * k + 70)).collect();
        let found = taken(&[both, alone].concat());
        let refused = found[60..].iter().filter(|taken| !**taken).count();
        assert!((8..=11).contains(&refused), "a second: {refused}");
        assert!(found[75..].iter().all(|taken| *taken));
    }

    #[test]
    fn three_processes_of_one_name_are_one_and_two_faults_that_are_held_off() {
        let all: Vec<_> = (0..30)
            .flat_map(|k| (0..3_i64).map(move |p| (1 + p as u64, 100 * k + 30 * p, 100 * k + 30 * p + 20)))
            .collect();
        let found = taken(&all);
        assert!(found.chunks(3).skip(5).all(|three| three == [true, false, false]), "{found:?}");
    }
}
