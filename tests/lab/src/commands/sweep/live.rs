//! One point over the network: agents and hubs are processes, and each method is one hub. All hubs receive the same
//! frames.
//!
//! A relay carries all traffic; the hubs are routers that join it. Scenario time starts when all processes are ready,
//! so that the agents send the same frames as in virtual time.

use crate::commands::process_time::cpu_s;
use crate::commands::sweep::virtual_time::{agents_bodies, heard_by, observers};
use crate::data::recording::run_log;
use crate::data::run_log::{ReceivedDetections, RunLog};
use crate::data::simulation::Simulation;
use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::plan::{Length, Point};
use crate::drive::traffic;
use crate::drive::traffic::SendTimes;
use crate::loopback::consumer::{Consumer, Subscription, Traffic};
use crate::loopback::{AgentOptions, Child, HubOptions, Launcher};
use crate::score::coverage::Coverage;
use crate::score::sweep::provenance::Provenance;
use crate::score::sweep::record::{AgentStatistics, Record, Reference};
use crate::score::sweep::scorer::{Scope, Scorer};
use crate::score::sweep::snapshots::Snapshots;
use crate::score::sweep::transit::{ArrivedFrame, add_transit};
use anyhow::{Context, ensure};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::net::logging;
use v2x_common::net::session::SessionOptions;
use v2x_common::recording::Entry;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use v2x_fusion_hub::hub::HubSettings;
use v2x_fusion_hub::hub::HubStatus;

/// Time until scenario time starts: a constant part and a part for each agent, in which the agents must start.
const HEAD_START: Span = Span::from_millis(700);
const HEAD_START_OF_EACH_MS: i64 = 400;
/// Settings of a hub that accepts no agent and publishes rarely.
const RELAY: &str =
    "[hub]\nid = \"relay\"\nonly_agents = [\"none\"]\npublish = { mode = \"fixed\", rate_hz = 0.1 }\n";
const TOO_BUSY: &str = "this machine is too busy for a live sweep; try fewer --methods";
/// Time to wait at the end for messages in transit.
const DRAIN: Duration = Duration::from_millis(300);
/// Capacity of the queue of samples.
const QUEUE: usize = 100_000;
const HUB_PATIENCE: Duration = Duration::from_secs(20);

/// One hub of a run.
struct MethodHub {
    method: SweepMethod,
    settings: HubSettings,
    process: Child,
}

/// The last status of a hub.
struct Ended {
    method: SweepMethod,
    settings: HubSettings,
    status: HubStatus,
    cpu_share: Option<f64>,
}

/// The results of a run.
struct Outcome {
    start: Timestamp,
    log: RunLog,
    hubs: Vec<Ended>,
}

/// Runs the methods and returns one record each. `None` after a shutdown; all processes have ended then.
pub(crate) async fn run(
    point: &Point,
    methods: &[SweepMethod],
    (length, folder): (Length, &Path),
    shutdown: &CancellationToken,
) -> anyhow::Result<Option<Vec<Record>>> {
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    // Dropping a child kills it, so an early return leaves no process behind.
    let outcome = tokio::select! {
        outcome = run_network(point, methods, (length, folder), shutdown) => outcome?,
        () = shutdown.cancelled() => return Ok(None),
    };
    score(point, &outcome, length).map(Some)
}

async fn run_network(
    point: &Point,
    methods: &[SweepMethod],
    (length, folder): (Length, &Path),
    shutdown: &CancellationToken,
) -> anyhow::Result<Outcome> {
    let program = std::env::current_exe().context("finding this program")?;
    let network = NetworkId::new(&format!("sweep-{}", clock::now().as_micros()))?;
    let launcher = Launcher::new(program, network).with_logs(folder, logging::DEFAULT_FILTER);
    let scenario = write(folder, "scenario.toml", &point.text)?;
    // The relay is a separate hub, so that carrying traffic does not count as processor time of a method.
    let config = Some(write(folder, "relay.toml", RELAY)?);
    let (relay, connect) =
        launcher.hub_named("relay", &HubOptions { config, ..HubOptions::default() }).await?;
    let mut hubs = Vec::new();
    for method in methods {
        hubs.push(start_hub(&launcher, (point, *method), (folder, &connect)).await?);
    }
    let session = SessionOptions { connect: vec![connect.clone()], ..SessionOptions::default() };
    let subscription = Subscription { network, traffic: Traffic::Everything, hub: None, capacity: QUEUE };
    let consumer = Consumer::connect(&session, subscription, HUB_PATIENCE, shutdown).await?;
    let consumer = consumer.context("interrupted")?;
    let start =
        clock::now() + HEAD_START + Span::from_millis(HEAD_START_OF_EACH_MS * i64::try_from(point.n_agents)?);
    let options = AgentOptions { scenario, connect, seed: point.seed, start };
    let mut agents = Vec::new();
    for agent in point.scenario.agents.iter().take(point.n_agents) {
        agents.push(launcher.agent(&agent.id(), &options).await?);
    }
    let late = clock::now() - start;
    ensure!(late < Span::ZERO, "agents were ready {late} late: {TOO_BUSY}");
    let watched_from = clock::now();
    let busy_before: Vec<_> = hubs.iter().map(|hub| cpu_s(&hub.process)).collect();
    let entries = receive(&consumer, start + length.duration).await;
    let watched_s = (clock::now() - watched_from).as_secs_f64();
    let busy = hubs.iter().map(|hub| cpu_s(&hub.process)).zip(busy_before);
    let shares: Vec<_> = busy.map(|(after, before)| Some((after? - before?) / watched_s)).collect();
    ensure!(consumer.dropped() == 0, "{} samples were dropped: {TOO_BUSY}", consumer.dropped());
    for agent in agents {
        end_agent(agent).await?;
    }
    consumer.close().await?;
    let mut ended = Vec::new();
    for (hub, cpu_share) in hubs.into_iter().zip(shares) {
        ended.push(end_hub(hub, cpu_share).await?);
    }
    relay.end("stopped").await?;
    Ok(Outcome { start, log: run_log(entries.into_iter().map(Ok))?, hubs: ended })
}

async fn start_hub(
    launcher: &Launcher,
    (point, method): (&Point, SweepMethod),
    (folder, relay): (&Path, &str),
) -> anyhow::Result<MethodHub> {
    let table = point.hub_table(method);
    let settings = HubSettings::from_table(table.clone())?;
    let file: toml::Table = [("hub".to_owned(), table.into())].into_iter().collect();
    let config = write(folder, &format!("{}.toml", method.key()), &toml::to_string(&file)?)?;
    let options =
        HubOptions { config: Some(config), connect: vec![relay.to_owned()], ..HubOptions::default() };
    let (process, _) = launcher.hub_named(method.key(), &options).await?;
    Ok(MethodHub { method, settings, process })
}

/// Ends an agent; an error if it could not send all its frames.
async fn end_agent(agent: Child) -> anyhow::Result<()> {
    let name = agent.name().to_owned();
    let (_, words) = agent.end("stopped").await?;
    let words = words.with_context(|| format!("agent {name} ended without a report"))?;
    for trouble in ["frames_skipped", "put_errors"] {
        let n = words[trouble].as_u64().unwrap_or(0);
        ensure!(n == 0, "agent {name} reports {trouble}: {n}; {TOO_BUSY}");
    }
    Ok(())
}

/// Ends a hub; an error if it could not keep up.
async fn end_hub(hub: MethodHub, cpu_share: Option<f64>) -> anyhow::Result<Ended> {
    let MethodHub { method, settings, process } = hub;
    let (_, words) = process.end("stopped").await?;
    let mut words = words.with_context(|| format!("the hub {} ended without a report", method.key()))?;
    let status: HubStatus = serde_json::from_value(words["status"].take())?;
    let lost = status.dropped_overload + status.publish_errors + status.births_refused;
    ensure!(lost == 0, "the hub {} could not keep up: {TOO_BUSY}", method.key());
    Ok(Ended { method, settings, status, cpu_share })
}

/// Records all samples until a short time after `end`.
async fn receive(consumer: &Consumer, end: Timestamp) -> Vec<Entry> {
    let mut entries = Vec::new();
    let until = tokio::time::sleep((end - clock::now()).to_duration() + DRAIN);
    tokio::pin!(until);
    loop {
        tokio::select! {
            () = &mut until => return entries,
            entry = consumer.next() => entries.push(entry),
        }
    }
}

fn score(point: &Point, outcome: &Outcome, length: Length) -> anyhow::Result<Vec<Record>> {
    let Outcome { start, log, hubs } = outcome;
    let (start, end) = (*start, *start + length.duration);
    let mut provenance = Provenance::default();
    let mut all = Vec::new();
    // Only the simulation knows when frames were captured and sent; it runs here with the parameters of the agents.
    let agents = traffic::agents(&point.scenario, point.seed, start);
    let senders: BTreeMap<AgentId, _> = agents.map(|agent| (agent.sensor().config().agent, agent)).collect();
    let mut buffer = Vec::new();
    for ReceivedDetections { received_at, frame, identities } in &log.detections {
        let Some(sender) = senders.get(&frame.id.agent) else { continue };
        let times = SendTimes::of(sender, frame.id.sequence);
        provenance.insert(frame.id, times.captured_at, identities.objects.clone());
        buffer.clear();
        wire::detections::encode(frame, &mut buffer)?;
        let (stamp, bytes) = (frame.captured_at, buffer.len());
        all.push(ArrivedFrame { agent: frame.id.agent, stamp, times, at: *received_at, bytes });
    }
    let simulation = Simulation::new(&point.scenario, point.seed, start);
    let observers = observers(point, &simulation);
    simulation.with_truth(|truth| {
        let coverage = Coverage::new(truth, &observers);
        let mut snapshots = Snapshots::new(coverage, agents_bodies(&simulation), start, end);
        let score_one = |Ended { method, settings, status, cpu_share }: &Ended| {
            let reference = Reference { agent: point.first_agent(), is_alone: method.is_alone() };
            let scope = Scope { reference, start: start + length.settle, end };
            let mut scorer = Scorer::new(&mut snapshots, &provenance, scope);
            let own = log.fused.iter().filter(|received| received.frame.hub.as_str() == method.key());
            own.for_each(|received| scorer.add(received));
            let mut record = scorer.finish();
            ensure!(!record.blocks.is_empty(), "the hub {} published nothing", method.key());
            add_transit(&mut record, &heard_by(settings, &all, end), reference, length.duration);
            add_status(&mut record, status, &reference.agent);
            record.cpu_share = *cpu_share;
            Ok(record)
        };
        hubs.iter().map(score_one).collect()
    })
}

fn add_status(record: &mut Record, status: &HubStatus, first: &AgentId) {
    for agent in &status.agents {
        let refused = agent.refused.iter().filter(|(reason, _)| *reason != "not_listened_to");
        record.add_statistics(&AgentStatistics {
            is_first: agent.id == *first,
            accepted: agent.accepted,
            out_of_sequence: agent.out_of_sequence,
            refused: refused.map(|(_, count)| count).sum(),
            nis_per_dof: agent.nis_per_dof,
        });
    }
}

fn write(folder: &Path, name: &str, text: &str) -> anyhow::Result<PathBuf> {
    let path = folder.join(name);
    std::fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
    Ok(path)
}
