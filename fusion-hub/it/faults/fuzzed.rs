//! Frames, descriptions and lists that nobody should send, in both codecs, beside an agent that is as it should be.

use super::agents::{Object, Payload, Process};
use super::dice::Dice;
use super::invariants::Lists;
use super::mutation::mutate;
use super::schedule::BEGIN;
use super::simulation::{MOST_REMEMBERED, SETTINGS, body};
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::id::AgentId;
use v2x_common::lists::{AreaFollower, DeltaFollower};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire::journal::Batch;
use v2x_common::wire::{self, ENCODING_JSON, ENCODING_POSTCARD};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::{Core, Handled, HubSettings};

/// Messages of one round, which has settings and objects of its own.
pub(super) const OF_ROUND: u64 = 1_000;
/// Time between two of them, ms; and between two lists and frames of the good agent, in messages.
const PERIOD_MS: i64 = 5;
const OF_PERIOD: u64 = 20;
/// The lineage of the hub whose lists are changed on their way to one that stands by.
const LINEAGE: u32 = 77;

/// How many messages there were, and what became of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Fuzzed {
    pub(super) frames: u64,
    pub(super) json_frames: u64,
    pub(super) descriptions: u64,
    pub(super) json_descriptions: u64,
    /// Lists, and what changes in them, as a consumer and a hub that stands by read them; batches of a journal.
    pub(super) lists: u64,
    pub(super) json_lists: u64,
    pub(super) journals: u64,
    pub(super) accepted: u64,
    pub(super) refused: u64,
    pub(super) reasons: BTreeMap<String, u64>,
    /// Frames of the good agent, all of which were accepted.
    pub(super) good: u64,
}

impl Fuzzed {
    pub(super) fn total(&self) -> u64 {
        self.frames
            + self.json_frames
            + self.descriptions
            + self.json_descriptions
            + self.lists
            + self.json_lists
            + self.journals
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.json_frames += other.json_frames;
        self.descriptions += other.descriptions;
        self.json_descriptions += other.json_descriptions;
        self.lists += other.lists;
        self.json_lists += other.json_lists;
        self.journals += other.journals;
        self.accepted += other.accepted;
        self.refused += other.refused;
        self.good += other.good;
        for (reason, count) in &other.reasons {
            *self.reasons.entry(reason.clone()).or_default() += count;
        }
    }
}

/// A hub that publishes, one that stands by for it, and a consumer.
struct Round {
    core: Core,
    standby: Core,
    lists: Lists,
    deltas: DeltaFollower,
    area: AreaFollower,
    /// Right messages of each kind.
    known: [Vec<Vec<u8>>; 2],
    report: Fuzzed,
}

/// One round of a seed; panics where something does not hold.
pub(super) fn run(seed: u64) -> Fuzzed {
    let dice = &mut Dice::new(seed ^ 0xf022);
    let settings: HubSettings =
        dice.of(&SETTINGS).parse().map(HubSettings::from_table).expect("TOML").expect("settings");
    let mut round = Round {
        core: Core::new(settings.clone(), Engine::new),
        standby: Core::new(settings, Engine::new),
        lists: Lists::default(),
        deltas: DeltaFollower::default(),
        area: AreaFollower::default(),
        known: Default::default(),
        report: Fuzzed::default(),
    };
    let objects: Vec<_> = (0..3 + dice.below(6)).map(|_| Object::drawn(dice)).collect();
    let mut processes: Vec<_> = ["good", "eve", "mallory", "oscar"].map(|name| process(name, dice)).into();
    let mut good = processes.remove(0);
    for n in 0..OF_ROUND {
        let since = Span::from_millis(PERIOD_MS * i64::try_from(n).expect("few"));
        let now = BEGIN + since;
        if n.is_multiple_of(OF_PERIOD) {
            let payload = good.right_frame(&objects, (now, since), dice);
            round.good_frame(good.agent, &payload, now);
            round.list(now, dice);
        }
        let place = dice.below(processes.len());
        let process = &mut processes[place];
        process.is_json = dice.happens(0.5);
        let payload = process.right_frame(&objects, (now, since), dice);
        round.fuzz(process, payload, now, dice);
    }
    let size = round.core.save().expect("a method of ours saves its state").len();
    assert!(size < MOST_REMEMBERED, "{size} bytes");
    round.check_everything_is_counted(good.agent);
    round.report
}

fn process(name: &str, dice: &mut Dice) -> Process {
    Process {
        agent: AgentId::new(name).expect("a legal name"),
        epoch: 1,
        sequence: 0,
        clock_offset: Span::ZERO,
        sigma_m: dice.between(0.05, 1.0),
        is_json: false,
    }
}

impl Round {
    fn good_frame(&mut self, agent: AgentId, payload: &Payload, now: Timestamp) {
        let handled = self.core.handle_frame(agent, now, &body(payload));
        assert!(matches!(handled, Handled::Accepted { .. }), "the good agent's frame: {handled:?}");
        self.standby.handle_frame(agent, now, &body(payload));
        self.report.good += 1;
    }

    /// Changes a right message, and gives it to whom it is for.
    fn fuzz(&mut self, process: &Process, mut payload: Payload, now: Timestamp, dice: &mut Dice) {
        let known = &mut self.known[usize::from(payload.is_json)];
        if known.len() < 64 {
            known.push(payload.bytes.clone());
        }
        if dice.happens(0.2) {
            payload = process.any_description(dice);
            mutate(&mut payload.bytes, payload.is_json, &[], dice);
            let count = match payload.is_json {
                true => &mut self.report.json_descriptions,
                false => &mut self.report.descriptions,
            };
            *count += 1;
            for core in [&mut self.core, &mut self.standby] {
                // A refused one is counted by the hub.
                let _ = core.handle_description(process.agent, &body(&payload));
            }
            return;
        }
        mutate(&mut payload.bytes, payload.is_json, &self.known[usize::from(payload.is_json)], dice);
        let count = if payload.is_json { &mut self.report.json_frames } else { &mut self.report.frames };
        *count += 1;
        self.standby.handle_frame(process.agent, now, &body(&payload));
        match self.core.handle_frame(process.agent, now, &body(&payload)) {
            Handled::Accepted { .. } => self.report.accepted += 1,
            Handled::Refused(refusal) => {
                self.report.refused += 1;
                *self.report.reasons.entry(refusal.reason().to_owned()).or_default() += 1;
            }
        }
        if dice.happens(0.05) {
            self.report.journals += 1;
            // As a batch of a journal, and as an update of a list.
            let _ = Batch::decode(&payload.bytes).map(|batch| batch.items().count());
            let _ = wire::delta::decode_update(&payload.bytes);
        }
    }

    /// Makes a list, and gives changed ones of it to a consumer and to the hub that stands by.
    fn list(&mut self, now: Timestamp, dice: &mut Dice) {
        let list = self.core.fused(now);
        self.lists.check(list, now);
        let mut of_other = list.clone();
        self.standby.unpublished(now);
        of_other.lineage = LINEAGE;
        let (mut wire_bytes, json) = (Vec::new(), wire::json::encode_fused(&of_other).expect("a sound list"));
        wire::fused::encode(&of_other, &mut wire_bytes).expect("a sound list");
        for (is_json, right) in [(false, wire_bytes), (true, json)] {
            for _ in 0..4 {
                let mut bytes = right.clone();
                mutate(&mut bytes, is_json, &[], dice);
                let count = if is_json { &mut self.report.json_lists } else { &mut self.report.lists };
                *count += 1;
                self.give_list(&bytes, is_json, dice);
            }
        }
        // Under the other hub's ids, whatever it said.
        let (mut ids, list) = (BTreeSet::new(), self.standby.fused(now));
        for object in &list.objects {
            assert!(ids.insert(object.track), "{} stands twice in the list of a standby", object.track);
        }
    }

    fn give_list(&mut self, bytes: &[u8], is_json: bool, dice: &mut Dice) {
        let decoded = if is_json { wire::json::decode_fused(bytes) } else { wire::fused::decode(bytes) };
        if let Ok(list) = decoded {
            self.standby.follow(&list);
            let digits: String = (0..1 + dice.below(6)).map(|_| *dice.of(&['0', '1', '2', '3'])).collect();
            if let Ok(tile) = digits.parse() {
                let _ = self.area.handle(tile, list);
                self.area.list();
            }
        }
        let encoding = if is_json { ENCODING_JSON } else { ENCODING_POSTCARD };
        if let Ok(update) = wire::decode_update(encoding, bytes) {
            let _ = self.deltas.handle(update);
        }
    }

    /// In = accepted + refused by reason.
    fn check_everything_is_counted(&self, good: AgentId) {
        let mut accepted = 0;
        let mut refused = BTreeMap::new();
        for (agent, record) in self.core.engine().agents().iter() {
            let statistics = &record.statistics;
            if *agent == good {
                assert_eq!((statistics.accepted, statistics.refused.len()), (self.report.good, 0));
                continue;
            }
            accepted += statistics.accepted;
            for (reason, count) in &statistics.refused {
                *refused.entry(reason.to_string()).or_default() += count;
            }
        }
        assert_eq!((accepted, &refused), (self.report.accepted, &self.report.reasons));
    }
}
