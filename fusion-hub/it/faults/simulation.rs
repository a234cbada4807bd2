//! One schedule, through the core of a hub.

use super::agents::Payload;
use super::dice::Dice;
use super::invariants::Lists;
use super::schedule::{BEGIN, Event, LENGTH, Schedule};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use v2x_common::id::{AgentId, FrameId};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::journal::Body;
use v2x_fusion_hub::diagnosis::Tokens;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::{Core, Handled, HubSettings};

/// After so long without any frame a hub has forgotten all of them.
const SILENCE: Span = Span::from_millis(60_000);
/// A hub's state is no larger than this after a few seconds of five agents, bytes: buffers are used again, not given back.
pub(super) const MOST_REMEMBERED: usize = 4 << 20;
/// A list at least so often.
const TICK: Span = Span::from_millis(100);

/// Settings that hubs run with: the default, and those which add to it or are something else.
pub(super) const SETTINGS: [&str; 8] = [
    "",
    "",
    "",
    "lagged = { lag_ms = 500, rate_hz = 10 }",
    "method = \"csba-wls\"",
    "delta_max_ms = 300",
    "registration = \"off\"",
    "motion = \"cv\"",
];

/// What became of everything.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Report {
    pub(super) frames: u64,
    pub(super) accepted: u64,
    pub(super) refused: u64,
    pub(super) descriptions: u64,
    pub(super) descriptions_refused: u64,
    pub(super) lists: u64,
    pub(super) objects: u64,
    pub(super) reasons: BTreeSet<String>,
    /// Of everything that was listed.
    fingerprint: u64,
}

impl Report {
    pub(super) fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.accepted += other.accepted;
        self.refused += other.refused;
        self.descriptions += other.descriptions;
        self.descriptions_refused += other.descriptions_refused;
        self.lists += other.lists;
        self.objects += other.objects;
        self.reasons.extend(other.reasons.iter().cloned());
        self.fingerprint ^= other.fingerprint;
    }
}

/// What was given to a hub of one agent.
#[derive(Debug, Default)]
struct Given {
    frames: u64,
    queue_full: u64,
    descriptions_refused: u64,
}

struct Simulation {
    core: Core,
    settings: HubSettings,
    lists: Lists,
    accepted: BTreeSet<(FrameId, Timestamp)>,
    given: BTreeMap<AgentId, Given>,
    report: Report,
    hasher: DefaultHasher,
    listed_at: Timestamp,
    /// Nothing comes any more.
    is_over: bool,
}

/// Runs the schedule of a seed; panics where something does not hold.
pub(super) fn run(seed: u64) -> Report {
    let mut dice = Dice::new(seed);
    let mut simulation = Simulation::drawn(&mut dice);
    let end = simulation.play(Schedule::drawn(BEGIN, &mut dice), &mut dice) + Span::from_millis(3_000);
    simulation.tick_until(end);
    simulation.check_everything_is_accounted_for();
    simulation.is_over = true;
    simulation.tick_until(end + SILENCE);
    simulation.check_all_is_forgotten();
    simulation.report.fingerprint = simulation.hasher.finish();
    simulation.report
}

/// Sizes of the state of one hub that lives through so many schedules, bytes.
pub(super) fn sizes_over(seed: u64, schedules: usize) -> Vec<usize> {
    let mut dice = Dice::new(seed);
    let mut simulation = Simulation::drawn(&mut dice);
    let mut begin = BEGIN;
    let size_after_one = |_| {
        begin = simulation.play(Schedule::drawn(begin, &mut dice), &mut dice);
        simulation.core.save().expect("a method of ours saves its state").len()
    };
    (0..schedules).map(size_after_one).collect()
}

impl Simulation {
    fn drawn(dice: &mut Dice) -> Self {
        let settings =
            dice.of(&SETTINGS).parse().map(HubSettings::from_table).expect("TOML").expect("settings");
        Self {
            core: Core::new(settings.clone(), Engine::new),
            settings,
            lists: Lists::default(),
            accepted: BTreeSet::new(),
            given: BTreeMap::new(),
            report: Report::default(),
            hasher: DefaultHasher::new(),
            listed_at: BEGIN,
            is_over: false,
        }
    }

    /// Plays a schedule; until when it lasted.
    fn play(&mut self, schedule: Schedule, dice: &mut Dice) -> Timestamp {
        // Everything later waits while the hub does not run.
        let mut runs_from = schedule.begin;
        let mut end = schedule.begin + LENGTH;
        for (at, event) in schedule.events {
            let now = at.max(runs_from);
            end = end.max(now);
            self.tick_until(now);
            if let Event::HeldUp(lasted) = event {
                runs_from = now + lasted;
                self.core.note_held_up(runs_from, lasted);
            } else {
                self.handle(event, now);
            }
            if dice.happens(0.7) {
                self.list(now);
            }
        }
        end.max(runs_from).max(self.listed_at)
    }

    fn tick_until(&mut self, until: Timestamp) {
        while self.listed_at + TICK <= until {
            // In silence rarely, which costs less.
            let step = if self.is_over { Span::from_millis(1_500) } else { TICK };
            self.list((self.listed_at + step).min(until));
            if self.listed_at == until {
                return;
            }
        }
    }

    fn handle(&mut self, event: Event, now: Timestamp) {
        match event {
            Event::Frame(agent, payload) => self.frame(agent, &payload, now),
            Event::Description(agent, payload) => {
                self.report.descriptions += 1;
                let refused = self.core.handle_description(agent, &body(&payload)).is_err();
                self.given.entry(agent).or_default().descriptions_refused += u64::from(refused);
                self.report.descriptions_refused += u64::from(refused);
                let record = self.core.engine().agents().record(&agent).expect("it is known by now");
                assert!(refused || record.description.is_some(), "{agent}: a description was lost");
            }
            Event::QueueFull(agent, count) => {
                self.core.note_queue_full(agent, count);
                self.given.entry(agent).or_default().queue_full += count;
            }
            Event::ClockStep(step) => self.core.note_clock_step(step),
            Event::HeldUp(_) => {}
            Event::Restored => {
                let state = self.core.save().expect("a method of ours saves its state");
                assert!(state.len() < MOST_REMEMBERED, "{} bytes", state.len());
                self.core = Core::restored(self.settings.clone(), &state).expect("its own state");
            }
        }
    }

    fn frame(&mut self, agent: AgentId, payload: &Payload, now: Timestamp) {
        self.report.frames += 1;
        self.given.entry(agent).or_default().frames += 1;
        match self.core.handle_frame(agent, now, &body(payload)) {
            Handled::Accepted { frame, .. } => {
                self.report.accepted += 1;
                assert!(
                    frame.agent == agent && self.accepted.insert((frame, now)),
                    "{frame:?} was accepted twice"
                );
            }
            Handled::Refused(refusal) => {
                self.report.refused += 1;
                self.report.reasons.insert(refusal.reason().to_owned());
            }
        }
    }

    fn list(&mut self, now: Timestamp) {
        let list = self.core.fused(now);
        self.lists.check(list, now);
        self.report.lists += 1;
        self.report.objects += list.objects.len() as u64;
        for object in &list.objects {
            (object.track, object.bev.x.to_bits(), object.existence.to_bits()).hash(&mut self.hasher);
        }
        self.listed_at = now;
        if let Some(lagged) = self.core.lagged(now) {
            assert!(lagged.fused_at < now && lagged.objects.is_sorted_by(|a, b| a.track < b.track));
        }
        if self.report.lists.is_multiple_of(16) {
            let alive = self.given.keys().copied().collect();
            self.core.diagnose(&Tokens { alive, ..Tokens::default() }, now);
        }
    }

    /// In = fused + refused by reason.
    fn check_everything_is_accounted_for(&self) {
        assert_eq!(self.lists.included, self.accepted, "each accepted frame is new in one list");
        let agents = self.core.engine().agents();
        for (agent, given) in &self.given {
            let statistics =
                &agents.record(agent).expect("every agent that sent anything is known").statistics;
            let refused: u64 = statistics.refused.values().sum();
            assert_eq!(statistics.accepted + refused, given.frames + given.queue_full, "{agent} {given:?}");
            assert_eq!(statistics.descriptions_refused, given.descriptions_refused, "{agent} {given:?}");
            let accepted = self.accepted.iter().filter(|(frame, _)| frame.agent == *agent).count();
            assert_eq!(statistics.accepted, accepted as u64, "{agent}");
        }
    }

    fn check_all_is_forgotten(&mut self) {
        assert_eq!(self.core.engine().counts().tracks, 0, "tracks of nothing");
        let state = self.core.save().expect("a method of ours saves its state");
        assert!(state.len() < MOST_REMEMBERED, "{} bytes after a minute of silence", state.len());
    }
}

pub(super) fn body(payload: &Payload) -> Body<'_> {
    if payload.is_json { Body::Json(&payload.bytes) } else { Body::Postcard(&payload.bytes) }
}
