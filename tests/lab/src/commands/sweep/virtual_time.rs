//! One point in virtual time: the frames once, and every method on them.

use crate::data::simulation::Simulation;
use crate::data::truth::Observer;
use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Length, Point};
use crate::drive::traffic::{Arrival, Listening, Traffic};
use crate::score::coverage::Coverage;
use crate::score::sweep::expected::Gallery;
use crate::score::sweep::record::{Books, Record};
use crate::score::sweep::scorer::{Focus, Judge, Whose};
use crate::score::sweep::transit::{Arrived, note_ways};
use anyhow::Context;
use std::collections::BTreeSet;
use v2x_agent::truth::ObjectId;
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::inbox::Inbox;
use v2x_fusion_hub::settings::HubSettings;

/// Any start does: the world is a function of scenario time.
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);

/// Who looks at what is scored: the first two agents.
pub(super) fn observers(point: &Point, simulation: &Simulation<'_>) -> Vec<Observer> {
    let facts = simulation.agent_facts(|_| None);
    let observer =
        |(config, facts): (&v2x_agent::scenario::AgentConfig, crate::data::simulation::AgentFacts)| {
            Observer { agent: config.id, field_of_view: config.field_of_view, itself: facts.itself }
        };
    point.scenario.agents.iter().zip(facts).take(2).map(observer).collect()
}

/// Runs the methods; one record each.
pub fn run(point: &Point, methods: &[SweepMethod], length: Length) -> anyhow::Result<Vec<Record>> {
    if methods.is_empty() {
        return Ok(Vec::new());
    }
    let end = START + length.duration;
    let traffic = Traffic::new(&point.scenario, point.seed, (START, length.duration), point.n_agents)?;
    let mut whose = Whose::default();
    for Arrival { frame, way, identities, .. } in &traffic.arrivals {
        whose.insert(frame.id, way.captured_at, identities.objects.clone());
    }
    let all: Vec<Arrived> = traffic.arrivals.iter().map(arrived).collect();
    let simulation = Simulation::new(&point.scenario, point.seed, START);
    let observers = observers(point, &simulation);
    simulation.with_truth(|truth| {
        let coverage = Coverage::new(truth, &observers);
        let mut gallery = Gallery::new((coverage, agents_bodies(&simulation)), (START, end));
        let mut records = Vec::with_capacity(methods.len());
        for method in methods {
            let settings = HubSettings::from_table(point.hub_table(*method)).context(method.key())?;
            let focus = Focus { first: point.first_agent(), is_alone: method.is_alone() };
            let mut judge = Judge::new(&mut gallery, &whose, focus, (START + length.settle, end));
            let listening = Listening {
                publish: settings.publish,
                start: START,
                until: Some(end),
                listens_to: |agent: &AgentId| settings.listens_to(agent),
            };
            let engine =
                traffic.feed(Engine::new(settings.engine), listening, |received| judge.add(&received))?;
            let mut record = judge.finish();
            note_ways(&mut record, &heard_by(&settings, &all, end), (focus, length.duration));
            note_books(&mut record, engine.inbox(), &point.first_agent());
            records.push(record);
        }
        Ok(records)
    })
}

fn arrived(Arrival { received_at, way, frame, bytes, .. }: &Arrival) -> Arrived {
    Arrived { agent: frame.id.agent, stamp: frame.captured_at, way: *way, at: *received_at, bytes: *bytes }
}

/// What a hub heard until the end.
pub(super) fn heard_by(settings: &HubSettings, all: &[Arrived], end: Timestamp) -> Vec<Arrived> {
    all.iter().filter(|frame| settings.listens_to(&frame.agent) && frame.at <= end).copied().collect()
}

/// The objects that agents are: they report themselves, better than anybody sees them.
pub(super) fn agents_bodies(simulation: &Simulation<'_>) -> BTreeSet<ObjectId> {
    simulation.agent_facts(|_| None).into_iter().filter_map(|facts| facts.itself).collect()
}

/// What the hub's books say.
fn note_books(record: &mut Record, inbox: &Inbox, first: &AgentId) {
    for (agent, books) in inbox.agents() {
        record.note_books(Books {
            is_first: agent == first,
            accepted: books.accepted,
            out_of_sequence: books.out_of_sequence,
            refused: books.refused_total(),
            nis_per_dof: books.nis_per_dof(),
        });
    }
}
