//! What learning remembers of a track between two epochs.

use super::class_counts::LastClasses;
use super::detection_counts::Opportunity;
use super::heading_counts::{Difference, Report, compare, is_due};
use super::innovation_counts::LastInnovation;
use super::pose_counts::{Displaced, SCALES, Standing, Stood};
use super::score_counts::{ELSEWHERE_M, Scored, Witness};
use crate::values::{AgentSlot, ScoreBand};
use serde::{Deserialize, Serialize};
use v2x_common::class::ClassGroup;

/// Detections from which on a track is taken for a real object: fewer may be clutter.
const LEAST_DETECTIONS: u32 = 4;
/// What two agents have detected so often from different places is real, however often they miss it.
const CONFIRMED_BY_EACH: u32 = 5;
/// Misses that wait for the object to be detected again; more of one agent are not counted.
const MOST_WAITING: usize = 64;

/// A miss that counts once the object is detected again: until then it may have gone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct WaitingMiss {
    pub(super) agent: AgentSlot,
    pub(super) opportunity: Opportunity,
}

/// What is remembered of one track.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct TrackMemory {
    n_detections: u32,
    /// Whether it was taken for a real object when that was last decided.
    pub(super) is_real: bool,
    /// Whether it stood then.
    pub(super) stands: bool,
    /// Of which classes it was then.
    pub(super) group: ClassGroup,
    /// Position of its last detection, m.
    pub(super) position: Option<[f64; 2]>,
    /// The agents, and what is remembered of each by its place among them.
    agents: Vec<AgentSlot>,
    by_agent: Vec<AgentMemory>,
    /// How many of them have a detection that another agent may confirm.
    n_scored: u32,
    /// Whether any of them has a detection of the time before it was clear that the object is real.
    has_doubted: bool,
    /// The class that each agent reported last.
    pub(super) classes: LastClasses,
    pub(super) waiting: Vec<WaitingMiss>,
}

/// A heading that was held against the course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Compared {
    /// Its difference, rad.
    pub(super) heading: f64,
    /// How its axis differs, and that of the last report but one before it, rad: they have no report in common.
    pub(super) pair: Option<[f64; 2]>,
}

/// What is remembered of one track and one agent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct AgentMemory {
    /// What its last frame held.
    last: Option<bool>,
    /// How many of its frames did.
    detections: u32,
    /// Those of the time before it was clear that the object is real.
    doubted: u32,
    /// Where its sensor was at the first one, m.
    seen_from: Option<[f32; 2]>,
    /// A report that a later one is to be compared with.
    report: Option<Report>,
    /// Where it was in its reports before.
    standing: Standing,
    /// How the axes of the last two reports that were compared differ from the course, the newer one last.
    differences: [Option<f64>; 2],
    /// Its last innovation.
    innovation: Option<LastInnovation>,
    /// Its last detection, until another agent has confirmed it or not.
    scored: Option<Scored>,
    /// The same, until its own next frame has.
    followed: Option<Scored>,
}

impl TrackMemory {
    /// Whether nothing of it was noted yet.
    pub(super) fn is_new(&self) -> bool {
        self.n_detections == 0
    }

    /// Whether what happens to it now says something about sensors.
    ///
    /// What one agent alone sees, and several others do not, is rather its error than theirs.
    pub(super) fn counts(&self) -> bool {
        let n_detecting = self.by_agent.iter().filter(|known| known.detections > 0).count();
        self.is_real && self.n_detections >= LEAST_DETECTIONS && 2 * n_detecting >= self.by_agent.len()
    }

    /// The agent's place.
    pub(super) fn place_of(&mut self, agent: AgentSlot) -> usize {
        self.known_place_of(agent).unwrap_or_else(|| {
            self.agents.push(agent);
            self.by_agent.push(AgentMemory::default());
            self.agents.len() - 1
        })
    }

    /// The agent's place, if it has one: whose misses count nowhere has none.
    pub(super) fn known_place_of(&self, agent: AgentSlot) -> Option<usize> {
        self.agents.iter().position(|known| *known == agent)
    }

    /// Frames are left out: the next one of each agent does not follow the last one that was noted.
    pub(super) fn leave_gap(&mut self) {
        for known in &mut self.by_agent {
            (known.last, known.followed) = (None, None);
        }
    }

    /// Notes a frame of the agent at a place; what its frame before held.
    pub(super) fn note(&mut self, place: usize, is_detected: bool) -> Option<bool> {
        self.n_detections += u32::from(is_detected);
        self.by_agent[place].last.replace(is_detected)
    }

    /// Notes a detection of the agent at a place, from a sensor there, m.
    pub(super) fn see(&mut self, place: usize, from: Option<[f64; 2]>) {
        let known = &mut self.by_agent[place];
        known.detections = known.detections.saturating_add(1);
        #[expect(clippy::cast_possible_truncation, reason = "single precision is enough")]
        let from = from.map(|position| position.map(|value| value as f32));
        known.seen_from = known.seen_from.or(from);
    }

    /// Notes that the last detection of the agent at a place is not known to be of something real.
    pub(super) fn doubt(&mut self, place: usize) {
        let known = &mut self.by_agent[place];
        known.doubted = known.doubted.saturating_add(1);
        self.has_doubted = true;
    }

    /// Notes that it is, and all before were: how many of each agent.
    pub(super) fn confirm(&mut self, place: usize, mut each: impl FnMut(AgentSlot, u32)) {
        each(self.agents[place], 1);
        if std::mem::take(&mut self.has_doubted) {
            for (agent, known) in self.agents.iter().zip(&mut self.by_agent) {
                each(*agent, std::mem::take(&mut known.doubted));
            }
        }
    }

    /// Whether no agent but the one at a place has detected it.
    pub(super) fn is_of_one(&self, place: usize) -> bool {
        let mut others = self.by_agent.iter().enumerate().filter(|(other, _)| *other != place);
        others.all(|(_, known)| known.detections == 0)
    }

    /// Whether agents in different places detect it.
    pub(super) fn is_seen_from_elsewhere(&self) -> bool {
        let mut often = self.by_agent.iter().filter(|known| known.detections >= CONFIRMED_BY_EACH);
        let mut places = often.by_ref().filter_map(|known| known.seen_from);
        let Some([x, y]) = places.next() else { return false };
        places.any(|[other_x, other_y]| libm::hypotf(other_x - x, other_y - y) >= ELSEWHERE_M as f32)
    }

    /// Compares a report's heading with the way since an earlier report of the agent, where there is one; else it waits.
    pub(super) fn compare_heading(&mut self, place: usize, report: Report) -> Option<Compared> {
        let AgentMemory { report: known, differences, .. } = &mut self.by_agent[place];
        let Some(earlier) = *known else {
            *known = Some(report);
            return None;
        };
        let is_comparable = is_due(&earlier, report.at)?;
        *known = Some(report);
        let difference = if is_comparable { compare(&earlier, &report) } else { None };
        let [before, last] = *differences;
        *differences = [last, difference.map(|difference| difference.axis)];
        let Difference { heading, axis } = difference?;
        Some(Compared { heading, pair: before.map(|before| [before, axis]) })
    }

    /// How far a report of the agent at a place is from those before, on each scale, where the object stands: by the track, or by
    /// the reports of one agent alone.
    pub(super) fn displaced(&mut self, place: usize, report: Stood) -> [Option<Displaced>; SCALES] {
        let mut displaced = self.by_agent[place].standing.take_in(report);
        if displaced.iter().all(Option::is_none) {
            return displaced;
        }
        let stands = self.stands || self.by_agent.iter().any(|known| known.standing.says_that_it_stands());
        if !stands || !self.counts() {
            return [None; SCALES];
        }
        let others = || self.by_agent.iter().enumerate().filter(|(other, _)| *other != place);
        for (scale, displaced) in displaced.iter_mut().enumerate() {
            if let Some(displaced) = displaced {
                displaced.beside(report.at, scale, others().map(|(_, other)| &other.standing));
            }
        }
        displaced
    }

    /// The agent's last innovation.
    pub(super) fn last_innovation(&mut self, place: usize) -> &mut Option<LastInnovation> {
        &mut self.by_agent[place].innovation
    }

    /// Notes a detection that another agent may confirm.
    pub(super) fn note_score(&mut self, place: usize, scored: Scored) {
        self.by_agent[place].followed = Some(scored);
        self.n_scored += u32::from(self.by_agent[place].scored.replace(scored).is_none());
    }

    /// The last detection of the agent at a place, once, for its next frame.
    pub(super) fn take_followed(&mut self, place: usize) -> Option<Scored> {
        self.by_agent[place].followed.take()
    }

    /// Whether there is a detection that another agent may confirm.
    pub(super) fn has_scored(&self) -> bool {
        self.n_scored > 0
    }

    /// What a frame of the agent at a place, or of one that has none, says of the last detections of other agents; each is asked of once.
    pub(super) fn witnessed(
        &mut self,
        place: Option<usize>,
        witness: &Witness,
        mut each: impl FnMut(AgentSlot, ScoreBand),
    ) {
        let others =
            self.agents.iter().zip(&mut self.by_agent).enumerate().filter(|(other, _)| Some(*other) != place);
        for (_, (agent, known)) in others {
            if let Some(scored) = known.scored.take_if(|scored| witness.is_of(scored)) {
                self.n_scored -= 1;
                each(*agent, scored.band);
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
