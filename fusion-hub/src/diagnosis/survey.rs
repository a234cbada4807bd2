//! Statistics over ten seconds, and what is found in them.

use super::arrivals::Transport;
use super::copies::Places;
use super::feedback::Published;
use super::finding::Finding;
use super::headings::Moving;
use super::judge;
use super::observation::Observation;
use super::window::{Surroundings, Window};
use crate::engine::Refusal;
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::fused::FusedFrame;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};

/// Statistics are gathered for so long.
const WINDOW: Span = Span::from_millis(10_000);
/// A window of less says little by itself.
const WINDOW_SAYS: Span = Span::from_millis(5_000);
/// Pairs of agents that are compared in one call: some milliseconds.
const FITS_AT_ONCE: usize = 1;
/// A list is taken in this often at most.
const LISTS_APART: Span = Span::from_millis(100);

/// Frames whose detections are compared with objects and with each other, which costs: those captured in the first part of
/// each slot, by whatever agents, and only so many of a slot. The length divides no usual interval of sensors, so that each
/// agent's frames are among them.
const SLOT: Span = Span::from_millis(410);
const FIRST_PART: Span = Span::from_millis(110);
const MAX_OF_SLOT: usize = 24;
/// Agents of which it is known that they send: each of them has a place in a slot, or in one after the other.
const MAX_SAMPLED: usize = 256;
/// Agents whose objects are followed in one window.
const MAX_FOLLOWED: usize = 64;
/// Who is not in a window that has lasted so long is not heard any more.
const STILL_HEARD: Span = Span::from_millis(4_000);
/// Frames whose stamps are further from their arrival are compared with nothing.
const COMPARED_WITHIN: Span = Span::from_millis(5_000);
/// Slots that late frames may belong to.
const N_SLOTS: usize = 16;

/// Gathers, and judges.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    current: Window,
    /// Windows that are over.
    n_windows: usize,
    /// The last whole one, until it is judged.
    ended: Option<Window>,
    /// Beginning of the window that was judged last.
    judged_since: Option<Timestamp>,
    diagnosed_at: Option<Timestamp>,
    moving: Moving,
    published: Published,
    places: Places,
    samples: Samples,
    findings: Vec<Finding>,
    /// The pairs of agents that were compared last.
    pairs: Vec<[AgentId; 2]>,
    /// Of the window that was judged last.
    judged: BTreeMap<AgentId, Transport>,
}

impl Survey {
    /// Takes in a frame, whatever became of it.
    pub fn note_frame(&mut self, seen: &Observation<'_>) {
        let is_followed = is_followed(&seen.frame.id.agent, self.current.agents.len(), self.n_windows);
        let Some(agent) = self.current.agent(seen.frame.id.agent) else { return };
        agent.arrivals.note(seen);
        // With both, numbers and epochs show it.
        if !seen.reported.has_sequence || seen.frame.id.epoch == 0 {
            agent.streams.note(seen);
        }
        agent.contents.note(seen);
        agent.fed_back += u64::from(self.published.has_made(seen));
        agent.writing.note(seen);
        agent.sizes.note(seen);
        agent.own_tracks.note(seen);
        agent.views.note(seen);
        if is_followed {
            agent.scatter.note(seen);
            agent.stale.note(seen);
            agent.coasting.note(seen);
        }
        if let Some(of_whom) = self.places.note(seen) {
            *agent.copied.entry(of_whom).or_default() += 1;
        }
        // By stamps from anywhere nothing is compared.
        let is_of_now = (seen.received_at - seen.frame.captured_at).abs() <= COMPARED_WITHIN;
        if is_of_now {
            agent.speeds.note(seen);
            if is_followed {
                agent.paces.note(seen);
            }
        }
        if is_of_now && self.samples.takes(seen.frame.captured_at, seen.frame.id.agent) {
            agent.headings.note(seen, &self.moving);
            agent.velocities.note(seen);
            if !seen.reported.in_other_unit.is_empty() {
                agent.headings_in_other_unit.note_in_other_unit(seen, &self.moving);
            }
            self.current.snapshots.note(seen, &self.moving);
        }
    }

    /// Counts a refusal.
    pub fn note_refused(&mut self, agent: AgentId, refusal: &Refusal) {
        self.note_refusals(agent, refusal, 1);
    }

    /// Counts refusals of one kind.
    pub fn note_refusals(&mut self, agent: AgentId, refusal: &Refusal, n: u64) {
        let Some(agent) = self.current.agent(agent) else { return };
        let (count, last) = agent.refused.entry(refusal.reason()).or_insert_with(|| (0, refusal.clone()));
        *count += n;
        last.clone_from(refusal);
    }

    /// Takes in a list that is published.
    pub fn note_list(&mut self, list: &FusedFrame) {
        self.current.lists += 1;
        self.current.lists_with_objects += u64::from(!list.objects.is_empty());
        if self.moving.at().is_none_or(|at| (list.fused_at - at).abs() >= LISTS_APART) {
            self.moving.note(list);
            self.published.note(list);
        }
    }

    /// Judges what was gathered, a whole window where there is one. To be called about twice a second.
    pub fn diagnose(&mut self, around: &Surroundings<'_>, now: Timestamp) {
        if self.current.since.is_none() {
            self.current.begin(around, now);
        }
        self.diagnosed_at = Some(now);
        self.current.note_idle(around);
        let since = self.current.since.unwrap_or(now);
        // The next one begins when the last one is judged: pairs of many agents are not compared within ten seconds.
        if now - since >= WINDOW && self.ended.is_none() {
            let mut next = Window::default();
            next.begin(around, now);
            let mut ended = std::mem::replace(&mut self.current, next);
            ended.end(around, &self.pairs);
            self.ended = Some(ended);
            self.n_windows += 1;
        }
        if let Some(ended) = &mut self.ended {
            let is_compared = ended.fit_some(FITS_AT_ONCE);
            if is_compared && let Some(ended) = self.ended.take() {
                self.judge(&ended, around);
            }
        } else if self.judged_since.is_none() {
            self.findings = judge::findings(&self.current, around);
        }
    }

    /// Judges everything that was gathered since the last whole window, at the end of a listening time.
    pub fn conclude(&mut self, around: &Surroundings<'_>) {
        if let Some(mut ended) = self.ended.take() {
            ended.fit_some(usize::MAX);
            self.judge(&ended, around);
        }
        // A window that has just begun shows nothing that the one before does not.
        let is_short = self.current.since.is_some_and(|since| around.engine.now() - since < WINDOW_SAYS);
        if self.judged_since.is_some() && is_short {
            return;
        }
        self.current.end(around, &self.pairs);
        self.current.fit_some(usize::MAX);
        let current = std::mem::take(&mut self.current);
        self.judge(&current, around);
        self.current = current;
    }

    /// Judges a whole window; its figures are shown beside its findings.
    fn judge(&mut self, window: &Window, around: &Surroundings<'_>) {
        let transports = window.agents.iter();
        let transports = transports.filter_map(|(agent, one)| Some((*agent, Transport::of(&one.arrivals)?)));
        self.judged = transports.collect();
        self.findings = judge::findings(window, around);
        self.pairs.clone_from(&window.pairs);
        self.judged_since = window.since;
    }

    /// The beginning of the ten seconds that were judged last; `None` before the first ones are over.
    pub const fn judged_since(&self) -> Option<Timestamp> {
        self.judged_since
    }

    /// The findings of the last diagnosis.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// How an agent's frames arrive, in the time that the findings are of; of this window for who was not there then. `None` of one
    /// that has not been heard for some seconds.
    pub fn transport(&self, agent: &AgentId) -> Option<Transport> {
        let lasted = self.current.since.zip(self.diagnosed_at).map(|(since, at)| at - since);
        let is_heard =
            lasted.is_none_or(|lasted| lasted < STILL_HEARD) || self.current.agents.contains_key(agent);
        let judged = self.judged.get(agent).filter(|_| is_heard).copied();
        judged.or_else(|| Transport::of(&self.current.agents.get(agent)?.arrivals))
    }
}

/// Whether objects of an agent are followed from frame to frame in a window. That costs: of many agents a part is, in turn.
fn is_followed(agent: &AgentId, n_agents: usize, window: usize) -> bool {
    let n_parts = n_agents.div_ceil(MAX_FOLLOWED).max(1);
    let part =
        agent.as_str().bytes().fold(0_usize, |sum, byte| sum.wrapping_mul(31).wrapping_add(byte.into()));
    (part % n_parts + window).is_multiple_of(n_parts)
}

/// Which frames are compared.
#[derive(Clone, Debug, Default)]
struct Samples {
    /// Who sends, with the last slot of each.
    agents: BTreeMap<AgentId, Timestamp>,
    /// Frames taken, by slot.
    taken: BTreeMap<Timestamp, Taken>,
}

/// Of one slot.
#[derive(Clone, Debug, Default)]
struct Taken {
    agents: BTreeSet<AgentId>,
    /// Frames beyond the first of each agent.
    more: usize,
}

impl Samples {
    fn takes(&mut self, captured_at: Timestamp, agent: AgentId) -> bool {
        let slot = captured_at.floor_to(SLOT);
        if captured_at - slot >= FIRST_PART {
            return false;
        }
        self.note(agent, slot);
        if !self.has_turn(agent, slot) {
            return false;
        }
        if self.taken.len() >= N_SLOTS && !self.taken.contains_key(&slot) {
            self.taken.pop_first();
        }
        let taken = self.taken.entry(slot).or_default();
        if taken.agents.len() < MAX_OF_SLOT && taken.agents.insert(agent) {
            return true;
        }
        // What others may need is left for them.
        let spare = MAX_OF_SLOT.saturating_sub(self.agents.len().max(taken.agents.len()));
        let is_one_more = taken.agents.contains(&agent) && taken.more < spare;
        taken.more += usize::from(is_one_more);
        is_one_more
    }

    /// Notes that an agent sends; who has not sent for some slots is forgotten at the next one.
    fn note(&mut self, agent: AgentId, slot: Timestamp) {
        if !self.taken.contains_key(&slot) {
            self.agents.retain(|_, last| slot - *last <= STILL_HEARD);
        }
        if self.agents.len() < MAX_SAMPLED || self.agents.contains_key(&agent) {
            self.agents.insert(agent, slot);
        }
    }

    /// Where there are more agents than places in a slot, those of one slot follow those of the last one in their order by name.
    fn has_turn(&self, agent: AgentId, slot: Timestamp) -> bool {
        let n = self.agents.len();
        if n <= MAX_OF_SLOT {
            return true;
        }
        let Ok(slot_number) = usize::try_from(slot.as_nanos() / SLOT.as_nanos()) else { return false };
        let first = slot_number.wrapping_mul(MAX_OF_SLOT) % n;
        let place = self.agents.range(..agent).count();
        (place + n - first) % n < MAX_OF_SLOT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::Source;
    use crate::engine::Engine;

    #[test]
    fn a_window_of_many_agents_is_judged_before_the_next_one_takes_its_place() {
        use crate::engine::EngineConfig;
        use v2x_common::detection::DetectionFrame;
        use v2x_common::id::{FrameId, HubId};
        let engine = Engine::new(EngineConfig::new(HubId::new("hub").unwrap(), 1));
        let (tokens, mut survey) = (crate::diagnosis::Tokens::default(), Survey::default());
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(1_000_000 + ms);
        let car = v2x_common::detection::Detection {
            class: v2x_common::class::Class::Car,
            score: 1.0,
            bev: v2x_common::geometry::BevBox { x: 5.0, y: 5.0, w: 1.8, d: 4.5, yaw: 0.0 },
            covariance: v2x_common::covariance::BoxCovariance {
                position: v2x_common::covariance::Covariance2::isotropic(0.25),
                ww: 0.1,
                dd: 0.1,
                yaw: 0.1,
            },
            velocity: None,
            heading: v2x_common::detection::HeadingKind::Known,
            source_track: None,
        };
        for k in 0..700 {
            for n in 0..8_u64 {
                let agent = AgentId::new(&format!("a{n}")).unwrap();
                let id = FrameId { agent, epoch: 1, sequence: k };
                let captured_at = at(100 * k.cast_signed());
                let frame =
                    DetectionFrame { detections: vec![car], ..DetectionFrame::empty(id, captured_at) };
                survey.note_frame(&Observation {
                    frame: &frame,
                    reported: &Default::default(),
                    received_at: captured_at,
                });
            }
            if k % 10 == 0 {
                survey.diagnose(
                    &Surroundings { engine: &engine, tokens: &tokens, source: Source::Network },
                    at(100 * k.cast_signed()),
                );
            }
        }
        assert!(
            survey.judged_since().is_some_and(|since| since >= at(10_000)),
            "{:?}",
            survey.judged_since()
        );
    }

    #[test]
    fn the_figures_of_an_agent_are_of_the_time_that_its_findings_are_of() {
        use crate::diagnosis::{Code, Tokens};
        use crate::engine::EngineConfig;
        use v2x_common::detection::DetectionFrame;
        use v2x_common::id::{FrameId, HubId};
        use v2x_common::reported::Reported;
        let engine = Engine::new(EngineConfig::new(HubId::new("hub").unwrap(), 1));
        let (tokens, mut survey) = (Tokens::default(), Survey::default());
        let agent = AgentId::new("a").unwrap();
        let reported = Reported { has_sequence: true, ..Reported::default() };
        // Of the second ten seconds a quarter is lost, of the third nothing.
        for k in 0..290_u64 {
            let at = Timestamp::EPOCH + Span::from_millis(1_000_000 + 100 * k.cast_signed());
            if !(100..200).contains(&k) || k % 4 != 1 {
                let frame = DetectionFrame::empty(FrameId { agent, epoch: 1, sequence: k }, at);
                survey.note_frame(&Observation { frame: &frame, reported: &reported, received_at: at });
            }
            if k % 10 == 0 {
                survey.diagnose(
                    &Surroundings { engine: &engine, tokens: &tokens, source: Source::Network },
                    at,
                );
            }
        }
        let gaps = survey.findings().iter().find(|one| one.code == Code::Gaps).expect("gaps");
        let missing = survey.transport(&agent).and_then(|one| one.missing).expect("a share");
        assert!(gaps.says.contains(&format!("({:.0} %)", 100.0 * missing)), "{gaps} {missing}");
        assert!((missing - 0.25).abs() < 0.02, "{missing}");
        // It ends, and its figures with the next window.
        for second in 30..46_i64 {
            let at = Timestamp::EPOCH + Span::from_millis(1_000_000 + 1_000 * second);
            survey.diagnose(&Surroundings { engine: &engine, tokens: &tokens, source: Source::Network }, at);
        }
        assert!(survey.transport(&agent).is_none());
    }

    #[test]
    fn objects_of_each_agent_are_followed_in_turn_and_of_few_in_every_window() {
        let agents: Vec<_> = (0..400).map(|n| AgentId::new(&format!("agent-{n:04}")).unwrap()).collect();
        assert!(agents.iter().all(|agent| (0..9).all(|window| is_followed(agent, 60, window))));
        for window in 0..7 {
            let n = agents.iter().filter(|agent| is_followed(agent, 400, window)).count();
            assert!((30..100).contains(&n), "{n} in window {window}");
        }
        assert!(
            agents.iter().all(|agent| (0..7).filter(|window| is_followed(agent, 400, *window)).count() == 1)
        );
    }

    #[test]
    fn each_agents_frames_are_among_the_samples_and_their_number_is_bounded() {
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(1_000_000 + ms);
        let agent = |n: i64| AgentId::new(&format!("a{n}")).unwrap();
        let taken = |frames: &mut dyn Iterator<Item = (i64, i64)>| {
            let mut samples = Samples::default();
            let mut taken = BTreeMap::<i64, usize>::new();
            for (ms, n) in frames.filter(|(ms, n)| samples.takes(at(*ms), agent(*n))) {
                assert!(ms >= 0);
                *taken.entry(n).or_default() += 1;
            }
            taken
        };
        // 10 Hz, and once in two seconds at any phase.
        assert!(taken(&mut (0..100).map(|k| (100 * k, 0)))[&0] >= 24);
        for phase in (0..2000).step_by(50) {
            assert!(taken(&mut (0..20).map(|k| (2000 * k + phase, 0)))[&0] >= 2, "phase {phase}");
        }
        // In one order at one time: nobody is always too late.
        for n in [20, 30, 60] {
            let each = taken(&mut (0..100).flat_map(|k| (0..n).map(move |n| (100 * k, n))));
            let least = each.values().min().copied().unwrap_or_default();
            assert!(each.len() == usize::try_from(n).unwrap() && least >= 8, "{n} agents: {each:?}");
        }
        let crowd = taken(&mut (0..100).flat_map(|k| (0..1000).map(move |n| (100 * k, n))));
        let crowd: usize = crowd.values().sum();
        assert!(crowd <= 25 * MAX_OF_SLOT, "{crowd}");
        // Stamps from anywhere.
        let mut samples = Samples::default();
        for k in 0..10_000 {
            samples.takes(at(k * 997_003), agent(k));
        }
        assert!(samples.taken.len() <= N_SLOTS && samples.agents.len() <= MAX_SAMPLED);
    }
}
