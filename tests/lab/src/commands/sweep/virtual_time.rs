//! One point in virtual time: all methods run on the same frames.

use crate::data::simulation::Simulation;
use crate::data::truth::Observer;
use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Length, Point};
use crate::drive::traffic::{Arrival, Listening, Traffic};
use crate::score::coverage::Coverage;
use crate::score::sweep::provenance::Provenance;
use crate::score::sweep::record::{AgentStatistics, Record, Reference};
use crate::score::sweep::scorer::{Scope, Scorer};
use crate::score::sweep::snapshots::Snapshots;
use crate::score::sweep::transit::{ArrivedFrame, add_transit};
use anyhow::Context;
use std::collections::BTreeSet;
use v2x_agent::truth::ObjectId;
use v2x_common::id::AgentId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::engine::AgentRegistry;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::HubSettings;

/// An arbitrary start: the world depends on scenario time only.
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);

/// The first two agents: objects are scored that they cover.
pub(super) fn observers(point: &Point, simulation: &Simulation<'_>) -> Vec<Observer> {
    let facts = simulation.agent_facts(|_| None);
    let observer =
        |(config, facts): (&v2x_agent::scenario::AgentConfig, crate::data::simulation::AgentFacts)| {
            Observer { agent: config.id(), field_of_view: config.sensor.field_of_view, itself: facts.itself }
        };
    point.scenario.agents.iter().zip(facts).take(2).map(observer).collect()
}

/// Runs the methods and returns one record each.
pub(crate) fn run(point: &Point, methods: &[SweepMethod], length: Length) -> anyhow::Result<Vec<Record>> {
    if methods.is_empty() {
        return Ok(Vec::new());
    }
    let end = START + length.duration;
    let traffic = Traffic::new(&point.scenario, point.seed, (START, length.duration), point.n_agents)?;
    let mut provenance = Provenance::default();
    for Arrival { frame, times, identities, .. } in &traffic.arrivals {
        provenance.insert(frame.id, times.captured_at, identities.objects.clone());
    }
    let all: Vec<ArrivedFrame> = traffic.arrivals.iter().map(arrived).collect();
    let simulation = Simulation::new(&point.scenario, point.seed, START);
    let observers = observers(point, &simulation);
    simulation.with_truth(|truth| {
        let coverage = Coverage::new(truth, &observers);
        let mut snapshots = Snapshots::new(coverage, agents_bodies(&simulation), START, end);
        let mut records = Vec::with_capacity(methods.len());
        for method in methods {
            let settings = HubSettings::from_table(point.hub_table(*method)).context(method.key())?;
            let reference = Reference { agent: point.first_agent(), is_alone: method.is_alone() };
            let scope = Scope { reference, start: START + length.settle, end };
            let mut scorer = Scorer::new(&mut snapshots, &provenance, scope);
            let listening = Listening { settings: &settings, start: START, until: Some(end) };
            let engine =
                traffic.feed(Engine::new(settings.engine), listening, |received| scorer.add(&received))?;
            let mut record = scorer.finish();
            add_transit(&mut record, &heard_by(&settings, &all, end), reference, length.duration);
            add_statistics(&mut record, engine.agents(), &point.first_agent());
            records.push(record);
        }
        Ok(records)
    })
}

fn arrived(Arrival { received_at, times, frame, bytes, .. }: &Arrival) -> ArrivedFrame {
    ArrivedFrame {
        agent: frame.id.agent,
        stamp: frame.captured_at,
        times: *times,
        at: *received_at,
        bytes: *bytes,
    }
}

/// The arrivals at a hub until the end.
pub(super) fn heard_by(settings: &HubSettings, all: &[ArrivedFrame], end: Timestamp) -> Vec<ArrivedFrame> {
    all.iter().filter(|frame| settings.listens_to(&frame.agent) && frame.at <= end).copied().collect()
}

/// The objects that are agents. They report themselves more accurately than any sensor.
pub(super) fn agents_bodies(simulation: &Simulation<'_>) -> BTreeSet<ObjectId> {
    simulation.agent_facts(|_| None).into_iter().filter_map(|facts| facts.itself).collect()
}

/// The statistics of a hub about its agents.
fn add_statistics(record: &mut Record, agents: &AgentRegistry, first: &AgentId) {
    for (agent, known) in agents.iter() {
        let statistics = &known.statistics;
        record.add_statistics(&AgentStatistics {
            is_first: agent == first,
            accepted: statistics.accepted,
            out_of_sequence: statistics.out_of_sequence,
            refused: statistics.refused_total(),
            nis_per_dof: statistics.nis_per_dof(),
        });
    }
}
