//! One point in virtual time: the frames once, and every method on them.

use super::gallery::Gallery;
use super::judge::{Judge, Whose};
use super::method::SweepMethod;
use super::plan::{Length, Point};
use super::record::{Fates, Record, distribution};
use crate::coverage::Coverage;
use crate::simulation::Simulation;
use crate::traffic::{Arrival, Listening, Traffic, Way};
use crate::truth::Observer;
use anyhow::Context;
use v2x_common::id::AgentId;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::inbox::Inbox;
use v2x_fusion_hub::settings::HubSettings;

/// Any start does: the world is a function of scenario time.
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);

/// Who looks at what is scored: the first two agents.
pub(super) fn observers(point: &Point, simulation: &Simulation<'_>) -> Vec<Observer> {
    let facts = simulation.agent_facts(|_| None);
    let observer = |(config, facts): (&v2x_agent::scenario::AgentConfig, crate::score::AgentFacts)| {
        Observer { agent: config.id, field_of_view: config.field_of_view, itself: facts.itself }
    };
    point.scenario.agents.iter().zip(facts).take(2).map(observer).collect()
}

/// Runs the methods; one record each.
pub fn run(point: &Point, methods: &[SweepMethod], length: Length) -> anyhow::Result<Vec<Record>> {
    let span = (START, START + length.duration);
    let traffic = Traffic::new(&point.scenario, point.seed, (START, length.duration), point.n_agents)?;
    let mut whose = Whose::default();
    for Arrival { frame, way, identities, .. } in &traffic.arrivals {
        whose.insert(frame.id, way.captured_at, identities.objects.clone());
    }
    let simulation = Simulation::new(&point.scenario, point.seed, START);
    let observers = observers(point, &simulation);
    simulation.with_truth(|truth| {
        let mut gallery = Gallery::new(Coverage::new(truth, &observers), span);
        let mut records = Vec::with_capacity(methods.len());
        for method in methods {
            let settings = HubSettings::from_table(point.hub_table(*method)).context(method.key())?;
            let mut engine = Engine::new(settings.engine);
            let mut judge = Judge::new(&mut gallery, &whose, (span.0 + length.settle, span.1));
            let listening = Listening {
                publish: settings.publish,
                start: START,
                until: Some(span.1),
                listens_to: |agent: &AgentId| settings.listens_to(agent),
            };
            traffic.feed(&mut engine, listening, |received| judge.add(&received))?;
            let mut record = judge.finish();
            let heard = |arrival: &&Arrival| settings.listens_to(&arrival.frame.id.agent);
            note_traffic(&mut record, traffic.arrivals.iter().filter(heard), length.duration);
            note_books(&mut record, engine.inbox(), &point.first_agent());
            records.push(record);
        }
        Ok(records)
    })
}

/// What the frames' ways were, and what they weigh.
fn note_traffic<'a>(record: &mut Record, arrivals: impl Iterator<Item = &'a Arrival>, duration: Span) {
    let mut bytes = 0;
    let mut ways = Vec::new();
    for arrival in arrivals {
        bytes += arrival.bytes;
        ways.push((arrival.way, arrival.received_at));
    }
    record.bytes_per_s = bytes as f64 / duration.as_secs_f64();
    note_ways(record, &ways);
}

/// How long frames took to be sent, and to arrive.
pub(super) fn note_ways(record: &mut Record, ways: &[(Way, Timestamp)]) {
    let millis = |of: fn(&(Way, Timestamp)) -> Span| {
        distribution(ways.iter().map(|way| of(way).as_millis_f64()).collect())
    };
    record.capture_to_send_ms = millis(|(way, _)| way.sent_at - way.captured_at);
    record.send_to_arrive_ms = millis(|(way, arrived_at)| *arrived_at - way.sent_at);
}

/// What the hub's books say.
fn note_books(record: &mut Record, inbox: &Inbox, first: &AgentId) {
    for (agent, books) in inbox.agents() {
        record.nis = (record.nis.0 + books.nis_sum / 2.0, record.nis.1 + books.nis_count);
        if agent != first {
            record.fates.add(&Fates {
                on_time: books.accepted - books.out_of_sequence,
                late: books.out_of_sequence,
                refused: books.refused_total(),
            });
        }
    }
}
