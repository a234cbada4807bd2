//! One point over the network: agents and hubs as processes, every method a hub of its own on the same frames.
//!
//! The first hub relays for everybody; the others are routers that join it. Scenario time begins when all are up, so
//! that agents send the very frames that they send in virtual time.

use super::gallery::Gallery;
use super::judge::{Judge, Whose};
use super::method::SweepMethod;
use super::plan::{Length, Point};
use super::record::{Fates, Record};
use super::virtual_point::{note_ways, observers};
use crate::consumer::{Consumer, Traffic};
use crate::coverage::Coverage;
use crate::loopback::{AgentOptions, Child, HubOptions, Launcher};
use crate::recorded::run_log;
use crate::run_log::RunLog;
use crate::simulation::Simulation;
use crate::traffic::{self, Way};
use anyhow::{Context, ensure};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_agent::sending::Sender;
use v2x_common::clock;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::net::logging;
use v2x_common::net::session::SessionOptions;
use v2x_common::recording::Entry;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::hub::HubStatus;
use v2x_fusion_hub::settings::HubSettings;

/// Agents take at most so long to be up; scenario time begins then.
const HEAD_START: Span = Span::from_millis(1500);
/// What is on its way at the end may take so long to come.
const DRAIN: Duration = Duration::from_millis(300);
/// Samples that may wait to be read.
const QUEUE: usize = 100_000;
const HUB_PATIENCE: Duration = Duration::from_secs(20);

/// One hub of the run.
struct MethodHub {
    method: SweepMethod,
    settings: HubSettings,
    process: Child,
}

/// What the run left.
struct Outcome {
    start: Timestamp,
    log: RunLog,
    bytes: Vec<(AgentId, usize)>,
    /// By method: its last status, and its processor time, s.
    hubs: Vec<(SweepMethod, HubSettings, HubStatus, Option<f64>)>,
}

/// Runs the methods; one record each. `None` where shutdown came first: all processes have ended then.
pub async fn run(
    point: &Point,
    methods: &[SweepMethod],
    (length, folder): (Length, &Path),
    shutdown: &CancellationToken,
) -> anyhow::Result<Option<Vec<Record>>> {
    std::fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    // Dropping children kills them: whatever ends this early leaves no process behind.
    let outcome = tokio::select! {
        outcome = play(point, methods, (length, folder), shutdown) => outcome?,
        () = shutdown.cancelled() => return Ok(None),
    };
    judge(point, &outcome, length).map(Some)
}

async fn play(
    point: &Point,
    methods: &[SweepMethod],
    (length, folder): (Length, &Path),
    shutdown: &CancellationToken,
) -> anyhow::Result<Outcome> {
    let program = std::env::current_exe().context("finding this program")?;
    let network = NetworkId::new(&format!("sweep-{}", clock::now().as_micros()))?;
    let launcher = Launcher::new(program, network).with_logs(folder, logging::DEFAULT_FILTER);
    let scenario = write(folder, "scenario.toml", &point.text)?;
    let (mut hubs, mut relay): (Vec<MethodHub>, Option<String>) = (Vec::new(), None);
    for method in methods {
        let table = point.hub_table(*method);
        let settings = HubSettings::from_table(table.clone())?;
        let file: toml::Table = [("hub".to_owned(), table.into())].into_iter().collect();
        let config = write(folder, &format!("{}.toml", method.key()), &toml::to_string(&file)?)?;
        let connect = relay.iter().cloned().collect();
        let options = HubOptions { config: Some(config), connect, ..HubOptions::default() };
        let (process, locator) = launcher.hub_named(method.key(), &options).await?;
        relay.get_or_insert(locator);
        hubs.push(MethodHub { method: *method, settings, process });
    }
    let connect = relay.context("no method to run")?;
    let session = SessionOptions { connect: vec![connect.clone()], ..SessionOptions::default() };
    let consumer =
        Consumer::connect(&session, network, (Traffic::Everything, QUEUE), HUB_PATIENCE, shutdown).await?;
    let consumer = consumer.context("interrupted")?;
    let start = clock::now() + HEAD_START;
    let options = AgentOptions { scenario, connect, seed: point.seed, start };
    let mut agents = Vec::new();
    for agent in point.scenario.agents.iter().take(point.n_agents) {
        agents.push(launcher.agent(&agent.id, &options).await?);
    }
    let late = clock::now() - start;
    ensure!(
        late < Span::ZERO,
        "the agents were {late} late to be up: this machine is too busy for a live sweep"
    );
    let busy_before: Vec<_> = hubs.iter().map(|hub| cpu_s(&hub.process)).collect();
    let entries = receive(&consumer, start + length.duration).await;
    let busy = hubs.iter().map(|hub| cpu_s(&hub.process)).zip(busy_before);
    let busy: Vec<_> = busy.map(|(after, before)| Some(after? - before?)).collect();
    ensure!(consumer.dropped() == 0, "{} samples were dropped: this machine is too busy", consumer.dropped());
    for agent in agents {
        agent.end("stopped").await?;
    }
    consumer.close().await?;
    let mut ended = Vec::new();
    for (MethodHub { method, settings, process }, busy_s) in hubs.into_iter().zip(busy).rev() {
        let (_, words) = process.end("stopped").await?;
        let mut words = words.with_context(|| format!("the hub {} ended without a report", method.key()))?;
        ended.push((method, settings, serde_json::from_value(words["status"].take())?, busy_s));
    }
    ended.reverse();
    let bytes = entries.iter().filter_map(|entry| match v2x_common::keys::Topic::of(&entry.key) {
        Some(v2x_common::keys::Topic::Detections(agent)) => Some((agent, entry.payload.len())),
        _ => None,
    });
    let bytes = bytes.collect();
    Ok(Outcome { start, log: run_log(entries.into_iter().map(Ok))?, bytes, hubs: ended })
}

/// Everything that comes until a while after `end`.
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

fn judge(point: &Point, outcome: &Outcome, length: Length) -> anyhow::Result<Vec<Record>> {
    let Outcome { start, log, bytes, hubs } = outcome;
    let span = (*start, *start + length.duration);
    let mut whose = Whose::default();
    // Nobody but the simulation knows when frames were captured and sent in truth; it tells here as it told the agents.
    let senders =
        traffic::agents(&point.scenario, point.seed, *start).map(|agent| (Sender::new(&agent), agent));
    let senders: BTreeMap<AgentId, _> =
        senders.map(|(sender, agent)| (agent.config().id, (sender, agent))).collect();
    let mut ways: Vec<(AgentId, Way, Timestamp)> = Vec::new();
    for received in &log.detections {
        let id = received.frame.id;
        let Some((sender, agent)) = senders.get(&id.agent) else { continue };
        let way = Way::of(agent, sender, id.sequence);
        whose.insert(id, way.captured_at, received.identities.objects.clone());
        ways.push((id.agent, way, received.received_at));
    }
    let simulation = Simulation::new(&point.scenario, point.seed, *start);
    let observers = observers(point, &simulation);
    let first = point.first_agent();
    simulation.with_truth(|truth| {
        let mut gallery = Gallery::new(Coverage::new(truth, &observers), span);
        let records = hubs.iter().map(|(method, settings, status, busy_s)| {
            let mut judge = Judge::new(&mut gallery, &whose, (span.0 + length.settle, span.1));
            let own = log.fused.iter().filter(|received| received.frame.hub.as_str() == method.key());
            own.for_each(|received| judge.add(received));
            let mut record = judge.finish();
            ensure!(!record.blocks.is_empty(), "the hub {} published nothing", method.key());
            let heard = bytes.iter().filter(|(agent, _)| settings.listens_to(agent));
            record.bytes_per_s =
                heard.map(|(_, bytes)| *bytes as f64).sum::<f64>() / length.duration.as_secs_f64();
            let heard = ways.iter().filter(|(agent, ..)| settings.listens_to(agent));
            note_ways(&mut record, &heard.map(|(_, way, at)| (*way, *at)).collect::<Vec<_>>());
            record.cpu_share = busy_s.map(|busy_s| busy_s / length.duration.as_secs_f64());
            note_status(&mut record, status, &first);
            Ok(record)
        });
        records.collect()
    })
}

fn note_status(record: &mut Record, status: &HubStatus, first: &AgentId) {
    for agent in &status.agents {
        if let Some(nis) = agent.nis_per_dof {
            record.nis = (record.nis.0 + nis * agent.accepted as f64, record.nis.1 + agent.accepted);
        }
        if agent.id != *first {
            let refused = agent.refused.iter().filter(|(reason, _)| *reason != "not_listened_to");
            record.fates.add(&Fates {
                on_time: agent.accepted - agent.out_of_sequence,
                late: agent.out_of_sequence,
                refused: refused.map(|(_, count)| count).sum(),
            });
        }
    }
}

fn write(folder: &Path, name: &str, text: &str) -> anyhow::Result<PathBuf> {
    let path = folder.join(name);
    std::fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
    Ok(path)
}

/// Processor time of a process by now, s; `None` where the system does not tell.
fn cpu_s(process: &Child) -> Option<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", process.process_id()?)).ok()?;
    // The name in brackets may hold anything; user and system time are the 12th and 13th field after it (proc(5)).
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let (user, system) = (fields.next()?.parse::<u64>().ok()?, fields.next()?.parse::<u64>().ok()?);
    Some((user + system) as f64 / rustix::param::clock_ticks_per_second() as f64)
}
