//! Statistics over ten seconds, and what is found in them.

use super::alignment::Snapshots;
use super::alignment::fit::{Fit, fit};
use super::arrivals::Arrivals;
use super::finding::Finding;
use super::headings::{Headings, Moving};
use super::judge;
use super::writing::Writing;
use crate::engine::{AgentRecord, Engine, Refusal};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedFrame;
use v2x_common::id::AgentId;
use v2x_common::reported::Reported;
use v2x_common::time::{Span, Timestamp};

/// Statistics are gathered for so long.
const WINDOW: Span = Span::from_millis(10_000);
/// Pairs of agents that are compared in one look: some milliseconds.
const FITS_AT_ONCE: usize = 2;
/// A list is looked at this often at most.
const LISTS_APART: Span = Span::from_millis(100);
/// Agents that are surveyed; more send, but nobody reads so many findings.
const MAX_AGENTS: usize = 256;

/// Frames whose detections are compared with objects and with each other, which costs: those captured in the first part of
/// each slot, by whatever agents, and only so many of a slot. The length divides no usual interval of sensors, so that each
/// agent's frames are among them.
const SLOT: Span = Span::from_millis(410);
const FIRST_PART: Span = Span::from_millis(110);
const MAX_OF_SLOT: u32 = 24;
/// Slots that late frames may belong to.
const N_SLOTS: usize = 16;

/// A frame as it arrived.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// With its detections in the map frame.
    pub frame: &'a DetectionFrame,
    /// How it was written.
    pub reported: &'a Reported,
    /// When it arrived, by the receiver's clock.
    pub received_at: Timestamp,
}

/// What there is to look at beside the frames.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// What it counts and learns of the agents.
    pub engine: &'a Engine,
    /// The agents that hold a liveliness token.
    pub alive: &'a BTreeSet<AgentId>,
}

/// Of one agent in one window.
#[derive(Clone, Debug, Default)]
pub(super) struct AgentSurvey {
    pub(super) arrivals: Arrivals,
    pub(super) writing: Writing,
    pub(super) headings: Headings,
    /// Refused frames by reason, each with the newest.
    pub(super) refused: BTreeMap<&'static str, (u64, Refusal)>,
    /// What the engine had counted when the window began.
    pub(super) before: Counts,
}

/// Counts of the engine.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub(super) dropped: u64,
    pub(super) unmapped: u64,
    pub(super) descriptions_refused: u64,
}

impl Counts {
    pub(super) fn of(record: &AgentRecord) -> Self {
        let statistics = &record.statistics;
        Self {
            dropped: statistics.dropped.total(),
            unmapped: statistics.unmapped_classes.total(),
            descriptions_refused: statistics.descriptions_refused,
        }
    }
}

/// All agents in one window.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    since: Option<Timestamp>,
    /// It lasted long enough to say what did not happen.
    pub(super) is_over: bool,
    pub(super) agents: BTreeMap<AgentId, AgentSurvey>,
    snapshots: Snapshots,
    pub(super) fits: BTreeMap<[AgentId; 2], Fit>,
    to_fit: Vec<[AgentId; 2]>,
}

/// Gathers, and judges.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    current: Window,
    /// The last whole one, until it is judged.
    ended: Option<Window>,
    is_judged: bool,
    moving: Moving,
    samples: Samples,
    findings: Vec<Finding>,
    /// Of the last whole window.
    before: BTreeMap<AgentId, Transport>,
}

impl Survey {
    /// Takes in a frame, whatever became of it.
    pub fn note_frame(&mut self, seen: &Observation<'_>) {
        let Some(agent) = self.current.agent(seen.frame.id.agent) else { return };
        agent.arrivals.note(seen);
        agent.writing.note(seen);
        if self.samples.takes(seen.frame.captured_at) {
            agent.headings.note(seen, &self.moving);
            self.current.snapshots.note(seen, &self.moving);
        }
    }

    /// Counts a refusal.
    pub fn note_refused(&mut self, agent: AgentId, refusal: &Refusal) {
        let Some(agent) = self.current.agent(agent) else { return };
        let (count, last) = agent.refused.entry(refusal.reason()).or_insert_with(|| (0, refusal.clone()));
        *count += 1;
        last.clone_from(refusal);
    }

    /// Takes in a list that is published.
    pub fn note_list(&mut self, list: &FusedFrame) {
        if self.moving.at().is_none_or(|at| (list.fused_at - at).abs() >= LISTS_APART) {
            self.moving.note(list);
        }
    }

    /// Looks at what was gathered, once in a second or so: at a whole window where there is one.
    pub fn look(&mut self, around: &Surroundings<'_>, now: Timestamp) {
        let since = *self.current.since.get_or_insert(now);
        if now - since >= WINDOW {
            let mut next = Window { since: Some(now), ..Window::default() };
            for (agent, record) in around.engine.agents().iter().take(MAX_AGENTS) {
                next.agents.entry(*agent).or_default().before = Counts::of(record);
            }
            let mut ended = std::mem::replace(&mut self.current, next);
            ended.is_over = true;
            let transports =
                ended.agents.iter().filter_map(|(agent, one)| Some((*agent, Transport::of(&one.arrivals)?)));
            self.before = transports.collect();
            ended.to_fit = ended.snapshots.pairs().copied().collect();
            self.ended = Some(ended);
        }
        match &mut self.ended {
            Some(ended) => {
                if ended.fit_some(FITS_AT_ONCE) {
                    self.findings = judge::findings(ended, around);
                    self.is_judged = true;
                    self.ended = None;
                }
            }
            None if !self.is_judged => self.findings = judge::findings(&self.current, around),
            None => {}
        }
    }

    /// Looks at everything that was gathered since the last whole window, at the end of a listening time.
    pub fn conclude(&mut self, around: &Surroundings<'_>) {
        let window = &mut self.current;
        window.is_over = true;
        window.to_fit = window.snapshots.pairs().copied().collect();
        window.fit_some(usize::MAX);
        self.findings = judge::findings(&self.current, around);
        self.is_judged = true;
    }

    /// What was found when it last looked.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// How an agent's frames arrive: of this window, or of the one before where this one has just begun.
    pub fn transport(&self, agent: &AgentId) -> Option<Transport> {
        let of = |window: &Window| Transport::of(&window.agents.get(agent)?.arrivals);
        of(&self.current).or_else(|| self.before.get(agent).copied())
    }
}

/// How an agent's frames arrive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transport {
    /// Frames a second.
    pub rate_hz: f64,
    /// Mean time from capture to arrival, ms, by the agent's and the hub's clocks.
    pub delay_ms: f64,
    /// Its standard deviation, ms.
    pub jitter_ms: f64,
    /// Share of frames that are missing by their sequence numbers; `None` where those do not count frames.
    pub missing: Option<f64>,
}

impl Transport {
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    fn of(arrivals: &Arrivals) -> Option<Self> {
        Some(Self {
            rate_hz: arrivals.rate_hz()?,
            delay_ms: 1e3 * arrivals.mean_delay_s(),
            jitter_ms: 1e3 * arrivals.jitter_s(),
            missing: arrivals.missing().map(|(missing, sent)| missing as f64 / (sent as f64).max(1.0)),
        })
    }
}

/// Which frames are compared.
#[derive(Clone, Debug, Default)]
struct Samples {
    /// Frames taken, by slot.
    taken: BTreeMap<Timestamp, u32>,
}

impl Samples {
    fn takes(&mut self, captured_at: Timestamp) -> bool {
        let slot = captured_at.floor_to(SLOT);
        if captured_at - slot >= FIRST_PART {
            return false;
        }
        if self.taken.len() >= N_SLOTS && !self.taken.contains_key(&slot) {
            self.taken.pop_first();
        }
        let taken = self.taken.entry(slot).or_default();
        *taken += 1;
        *taken <= MAX_OF_SLOT
    }
}

impl Window {
    fn agent(&mut self, agent: AgentId) -> Option<&mut AgentSurvey> {
        let has_room = self.agents.len() < MAX_AGENTS || self.agents.contains_key(&agent);
        has_room.then(|| self.agents.entry(agent).or_default())
    }

    /// Compares some of the pairs that are left; whether none is.
    fn fit_some(&mut self, most: usize) -> bool {
        for _ in 0..most {
            let Some(pair) = self.to_fit.pop() else { break };
            if let Some(snapshots) = self.snapshots.of(&pair) {
                self.fits.insert(pair, fit(snapshots));
            }
        }
        self.to_fit.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_agents_frames_are_among_the_samples_and_their_number_is_bounded() {
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        let taken = |frames: &mut dyn Iterator<Item = i64>| {
            let mut samples = Samples::default();
            frames.filter(|ms| samples.takes(at(*ms))).count()
        };
        // 10 Hz, and once in two seconds at any phase.
        assert!(taken(&mut (0..100).map(|k| 100 * k)) >= 24);
        for phase in (0..2000).step_by(50) {
            assert!(taken(&mut (0..20).map(|k| 2000 * k + phase)) >= 2, "phase {phase}");
        }
        let crowd = taken(&mut (0..100).flat_map(|k| (0..1000).map(move |_| 100 * k)));
        assert!(crowd <= 25 * MAX_OF_SLOT as usize, "{crowd}");
        // Stamps from anywhere.
        let mut samples = Samples::default();
        (0..10_000).for_each(|k| drop(samples.takes(at(k * 997_003))));
        assert!(samples.taken.len() <= N_SLOTS);
    }
}
