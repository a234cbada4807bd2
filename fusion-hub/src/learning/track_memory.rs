//! What learning remembers of a track between two epochs.

use super::class_counts::LastClasses;
use super::heading_counts::{Report, compare, is_due};
use super::innovation_counts::Innovation;
use crate::values::AgentSlot;

/// Detections from which on a track is taken for a real object: fewer may be clutter.
const LEAST_DETECTIONS: u32 = 4;
/// Misses that wait for the object to be detected again; more of one agent are not counted.
const MOST_WAITING: usize = 64;

/// A miss that counts once the object is detected again: until then it may have gone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WaitingMiss {
    pub(super) agent: AgentSlot,
    pub(super) range_bin: usize,
    /// What the agent's frame before held.
    pub(super) before: Option<bool>,
}

/// What is remembered of one track.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct TrackMemory {
    n_detections: u32,
    /// Whether it was taken for a real object when that was last decided.
    pub(super) is_real: bool,
    /// Position of its last detection, m.
    pub(super) position: Option<[f64; 2]>,
    /// What each agent's last frame held.
    last: Vec<(AgentSlot, bool)>,
    /// A report of each agent that a later one is to be compared with.
    reports: Vec<(AgentSlot, Report)>,
    /// The class that each agent reported last.
    pub(super) classes: LastClasses,
    pub(super) waiting: Vec<WaitingMiss>,
    /// The last innovation of each agent.
    innovations: Vec<(AgentSlot, Innovation)>,
}

impl TrackMemory {
    /// Whether nothing of it was noted yet.
    pub(super) fn is_new(&self) -> bool {
        self.n_detections == 0
    }

    /// Whether what happens to it now says something about sensors.
    pub(super) fn counts(&self) -> bool {
        self.is_real && self.n_detections >= LEAST_DETECTIONS
    }

    /// Notes a frame of an agent; what its frame before held.
    pub(super) fn note(&mut self, agent: AgentSlot, is_detected: bool) -> Option<bool> {
        self.n_detections += u32::from(is_detected);
        match self.last.iter_mut().find(|(known, _)| *known == agent) {
            Some((_, last)) => Some(std::mem::replace(last, is_detected)),
            None => {
                self.last.push((agent, is_detected));
                None
            }
        }
    }

    /// Compares a report's heading with the way since an earlier report of the agent, where there is one; else it waits.
    pub(super) fn compare_heading(&mut self, agent: AgentSlot, report: Report) -> Option<f64> {
        let Some((_, earlier)) = self.reports.iter_mut().find(|(known, _)| *known == agent) else {
            self.reports.push((agent, report));
            return None;
        };
        let is_comparable = is_due(earlier, report.at)?;
        let earlier = std::mem::replace(earlier, report);
        if is_comparable { compare(&earlier, &report) } else { None }
    }

    /// Takes the place of the agent's last innovation, which is returned.
    pub(super) fn replace_innovation(&mut self, agent: AgentSlot, own: Innovation) -> Option<Innovation> {
        match self.innovations.iter_mut().find(|(known, _)| *known == agent) {
            Some((_, last)) => Some(std::mem::replace(last, own)),
            None => {
                self.innovations.push((agent, own));
                None
            }
        }
    }

    /// Lets a miss wait.
    pub(super) fn wait(&mut self, miss: WaitingMiss) {
        if self.waiting.len() < MOST_WAITING {
            self.waiting.push(miss);
        }
    }
}
