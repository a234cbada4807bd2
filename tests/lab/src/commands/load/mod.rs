//! `lab load`: what a live hub takes, and what one agent that misbehaves costs the others.

mod generator;
mod hostile;

use crate::commands::process_time::cpu_s;
use crate::loopback::hub_status;
use crate::loopback::{Child, HubOptions, HubStatus, Launcher};
use anyhow::{Context, ensure};
use generator::{Generator, LoadSize, Sent};
use hostile::Hostile;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::duration::parse_seconds;
use v2x_common::id::NetworkId;
use v2x_common::keys::Keys;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::net::shutdown;
use zenoh::Session;

/// Time in which tracks settle before anything is counted.
const WARM_UP: Duration = Duration::from_secs(2);

/// Load a live hub: agents of one process publish over Zenoh to a hub of another process
///
/// Every five agents see the same objects, which drive on rings; all agents send at the same rate. Counted are the frames that the hub
/// accepted of those that were sent, its latency from the arrival of a frame to the list that holds it, and its processor
/// time, apart from the generator's. An agent that misbehaves is legal by the wire, and its own frames are not counted.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab load                              200 agents of 50 objects
  lab load --agents 600 --duration 20s  more than a core can take
  lab load --hz 60                      the same objects, more frames than a
                                        core can take
  lab load --agents 60 --hostile boxes  one more agent, with 4096 boxes a frame
  lab load --agents 50 --certs certs    with TLS, by the certificates of agents
                                        load-0000 … and the viewer load
  lab load --agents 10 --record load.mcap
                                        what a recording costs the hub
  lab load --config hub.toml --json")]
pub struct LoadArgs {
    /// Number of agents
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=1000))]
    agents: u32,
    /// Objects in view of each agent
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=1000))]
    objects: u32,
    /// Frames of each agent, Hz: more load on the same objects
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=200))]
    hz: u32,
    /// Time that is counted, such as 20s or 2min; a plain number is seconds
    #[arg(long, alias = "seconds", default_value = "10s", value_name = "DURATION", value_parser = counted)]
    duration: Duration,
    /// One more agent that misbehaves
    #[arg(long, value_enum)]
    hostile: Option<Hostile>,
    /// Settings of the hub, a TOML file [default: its defaults]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The hub records all of it into this file
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Each agent connects by itself, as from a machine of its own
    #[arg(long)]
    own_sessions: bool,
    /// The same with TLS: a folder of `v2x certs` with the hub `hub`, the agents load-0000, load-0001, … and the viewer load
    #[arg(long, value_name = "DIR", conflicts_with = "hostile")]
    certs: Option<PathBuf>,
    /// Seed of objects and reports
    #[arg(long, default_value_t = 1, value_parser = v2x_common::seed::parse_seed)]
    seed: u64,
    /// Print the result as one line of JSON
    #[arg(long)]
    json: bool,
}

/// A time that is counted.
fn counted(text: &str) -> Result<Duration, String> {
    let seconds = parse_seconds(text).map_err(|error| error.to_string())?;
    let is_within = (1.0..=3600.0).contains(&seconds);
    is_within
        .then(|| Duration::from_secs_f64(seconds))
        .ok_or_else(|| format!("{text} is not within 1s and 1h"))
}

/// What was measured.
#[derive(Clone, Debug, Serialize)]
struct LoadReport {
    agents: u32,
    rate_hz: u32,
    objects: u32,
    hostile: Option<Hostile>,
    sent: u64,
    accepted: u64,
    /// Accepted of those sent.
    accepted_share: f64,
    accepted_detections_per_s: f64,
    latency_ms: [Option<f64>; 3],
    compute_ms: Option<f64>,
    publish_ms: Option<f64>,
    lists_per_s: f64,
    fused_bytes_per_s: f64,
    hub_cores: Option<f64>,
    hub_memory_mb: Option<f64>,
    tracks: usize,
    /// Size of the hub's recording for each second of the run, the time before anything is counted included.
    recorded_bytes_per_s: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// Where the hub does not start or does not answer.
pub async fn load(args: &LoadArgs) -> anyhow::Result<ExitCode> {
    let shutdown = shutdown::token(false)?;
    let outcome = tokio::select! {
        report = measure(args, &shutdown) => report?,
        () = shutdown.cancelled() => return Ok(ExitCode::from(130)),
    };
    if args.json {
        crate::report::output::print(&format!("{}\n", serde_json::to_string(&outcome)?))?;
    } else {
        crate::report::output::print(&outcome.as_text())?;
    }
    Ok(ExitCode::SUCCESS)
}

async fn measure(args: &LoadArgs, shutdown: &CancellationToken) -> anyhow::Result<LoadReport> {
    let program = std::env::current_exe().context("finding this program")?;
    let network = NetworkId::new(&format!("load-{}", clock::now().as_micros()))?;
    let launcher = Launcher::new(program, network);
    let (hub, endpoint) = launcher.hub(&hub_options(args)).await?;
    let options = SessionOptions { connect: vec![endpoint.clone()], ..SessionOptions::default() };
    let senders = senders(args, &endpoint).await?;
    let watcher = session::open(session::client_config(&client(args, &endpoint, "viewer/load"))?).await?;
    let size = LoadSize { agents: args.agents, rate_hz: args.hz, objects: args.objects, seed: args.seed };
    let run_for = WARM_UP + args.duration;
    let generator = Generator::new(&size, run_for)?;
    let end = shutdown.child_token();
    let sent = Arc::new(Sent::default());
    let sending = tokio::spawn(generator.run(senders.clone(), Keys::new(network), sent.clone(), end.clone()));
    let hostile = args.hostile.map(|kind| {
        let options = options.clone();
        let end = end.clone();
        tokio::spawn(async move { hostile::run(kind, options, Keys::new(network), end).await })
    });
    tokio::time::sleep(WARM_UP).await;
    let fused_bytes = count_fused(&watcher, network).await?;
    let before = (status(&watcher, network).await?, sent.counts(), cpu_s(&hub), clock::now());
    tokio::time::sleep(args.duration).await;
    let counts = sent.counts();
    let cpu = cpu_s(&hub);
    let watched_s = (clock::now() - before.3).as_secs_f64();
    let bytes = fused_bytes.load(Ordering::Relaxed);
    sending.await??;
    // What was sent last is on its way.
    tokio::time::sleep(Duration::from_millis(300)).await;
    let after = status(&watcher, network).await?;
    end.cancel();
    if let Some(hostile) = hostile {
        hostile.await?.context("the agent that was to misbehave could not")?;
    }
    for session in senders.into_iter().chain([watcher]) {
        session::close(session).await?;
    }
    end_hub(hub).await?;
    let recorded =
        args.record.as_ref().map(std::fs::metadata).transpose().context("reading the recording's size")?;
    let accepted = accepted(&after) - accepted(&before.0);
    let sent_frames = counts.frames - before.1.frames;
    ensure!(sent_frames > 0, "nothing was sent: this machine is too busy");
    let per_frame = counts.detections as f64 / counts.frames as f64;
    let share = accepted as f64 / sent_frames as f64;
    Ok(LoadReport {
        agents: args.agents,
        rate_hz: args.hz,
        objects: args.objects,
        hostile: args.hostile,
        sent: sent_frames,
        accepted,
        accepted_share: share.min(1.0),
        accepted_detections_per_s: accepted as f64 * per_frame / watched_s,
        latency_ms: [after.latency_ms.p50, after.latency_ms.p95, after.latency_ms.p99],
        compute_ms: after.compute_ms.p50,
        publish_ms: after.publish_ms.p50,
        lists_per_s: (after.frames_published - before.0.frames_published) as f64 / watched_s,
        fused_bytes_per_s: bytes as f64 / watched_s,
        hub_cores: cpu.zip(before.2).map(|(after, before)| (after - before) / watched_s),
        hub_memory_mb: after.memory_bytes.map(|bytes| bytes as f64 / 1e6),
        tracks: after.tracks,
        recorded_bytes_per_s: recorded.map(|file| file.len() as f64 / run_for.as_secs_f64()),
    })
}

fn hub_options(args: &LoadArgs) -> HubOptions {
    let zenoh_config = args.certs.as_ref().map(|folder| folder.join("hub/hub/zenoh.json5"));
    let protocol = if zenoh_config.is_some() { "tls" } else { "tcp" };
    let listen = format!("{protocol}/127.0.0.1:0");
    let (config, record) = (args.config.clone(), args.record.clone());
    HubOptions { listen, config, zenoh_config, record, ..HubOptions::default() }
}

/// The session of an agent or a viewer, by its certificate where there is one.
fn client(args: &LoadArgs, endpoint: &str, who: &str) -> SessionOptions {
    let config = args.certs.as_ref().map(|folder| folder.join(who).join("zenoh.json5"));
    SessionOptions { config, connect: vec![endpoint.to_owned()], listen: Vec::new() }
}

/// One session for all agents, or one for each.
async fn senders(args: &LoadArgs, endpoint: &str) -> anyhow::Result<Vec<Session>> {
    let count = if args.own_sessions || args.certs.is_some() { args.agents } else { 1 };
    let mut sessions = Vec::new();
    for agent in generator::agents(count)? {
        let options = client(args, endpoint, &format!("agent/{agent}"));
        sessions.push(session::open(session::client_config(&options)?).await?);
    }
    Ok(sessions)
}

async fn status(session: &Session, network: NetworkId) -> anyhow::Result<HubStatus> {
    let statuses = hub_status::query(session, network).await?;
    statuses.into_iter().next().context("the hub does not answer: it is overloaded, or has ended")
}

/// Frames of agents that behave.
fn accepted(status: &HubStatus) -> u64 {
    let behaving = status.agents.iter().filter(|agent| agent.id.as_str() != hostile::NAME);
    behaving.map(|agent| agent.accepted).sum()
}

async fn count_fused(session: &Session, network: NetworkId) -> anyhow::Result<Arc<AtomicU64>> {
    let bytes = Arc::new(AtomicU64::new(0));
    let counted = bytes.clone();
    session
        .declare_subscriber(Keys::new(network).all_fused())
        .callback(move |sample| {
            counted.fetch_add(sample.payload().len() as u64, Ordering::Relaxed);
        })
        .background()
        .await
        .map_err(|error| anyhow::anyhow!("{error}"))?;
    Ok(bytes)
}

async fn end_hub(hub: Child) -> anyhow::Result<()> {
    hub.end("stopped").await?;
    Ok(())
}

impl LoadReport {
    fn as_text(&self) -> String {
        let or_dash = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
        let [p50, p95, p99] = self.latency_ms.map(or_dash);
        let against =
            self.hostile.map_or(String::new(), |kind| format!(" and one that sends {}", kind.in_words()));
        format!(
            "{} agents × {} objects × {} Hz{against}\n\
             accepted      {:.1} % of {} frames, {:.0} detections/s\n\
             latency       p50 {p50} ms, p95 {p95} ms, p99 {p99} ms (arrival of a frame to the list that holds it)\n\
             work          {} ms a frame and its list, {} ms a list; {:.1} lists/s of {:.2} MB/s\n\
             hub           {} cores, {} MB, {} tracks\n{}",
            self.agents,
            self.objects,
            self.rate_hz,
            100.0 * self.accepted_share,
            self.sent,
            self.accepted_detections_per_s,
            or_dash(self.compute_ms),
            or_dash(self.publish_ms),
            self.lists_per_s,
            self.fused_bytes_per_s / 1e6,
            or_dash(self.hub_cores),
            or_dash(self.hub_memory_mb),
            self.tracks,
            self.recorded_bytes_per_s.map_or_else(String::new, |bytes| format!(
                "recording     {:.1} MB a minute\n",
                bytes * 60.0 / 1e6
            )),
        )
    }
}
