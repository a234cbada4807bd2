//! `lab takeover`: how fast a hub that stands by takes over, and how many ids it keeps.

mod pair;

use crate::loopback::Launcher;
use anyhow::Context;
use pair::{Pair, kept_ids};
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;
use v2x_agent::scenario::Scenario;
use v2x_common::clock;
use v2x_common::id::NetworkId;
use v2x_common::net::shutdown;
use v2x_common::time::Span;

/// Kill the hub that publishes, and see what the one that stands by does
///
/// Two linked hubs and the agents of a scenario run as processes of this machine. Again and again the hub that publishes is
/// killed, when the other one knows its ids, and started again as the one that stands by. Counted are the time from its last list to
/// the first one of the other hub, at a consumer of that, and the ids of the last list that are in the first one for the same place.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab takeover                            20 times, about two minutes
  lab takeover --times 3 --scenario highway --json")]
pub struct TakeoverArgs {
    /// How often
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    times: u32,
    /// The scenario file, or a shipped scenario's name
    #[arg(long, default_value = "crossing", value_name = "FILE")]
    scenario: PathBuf,
    /// A folder for the logs of all processes
    #[arg(long, value_name = "DIR")]
    logs: Option<PathBuf>,
    /// Print the result as one line of JSON
    #[arg(long)]
    json: bool,
}

/// One takeover.
#[derive(Clone, Copy, Debug, Serialize)]
struct Takeover {
    /// From the last list of the hub that was killed to the first one of the other, ms.
    silent_ms: f64,
    /// From the kill to that list, ms.
    since_kill_ms: f64,
    /// Objects of the last list.
    objects: usize,
    /// Those that are in the first one, under the same id and at their place.
    kept: usize,
    /// Ids of the first list that are in the list two seconds later; objects also leave.
    kept_2s: f64,
    /// From the start of the process of the killed hub to its being ready again, ms.
    restart_ms: f64,
}

#[derive(Clone, Debug, Serialize)]
struct TakeoverReport {
    takeovers: Vec<Takeover>,
    worst_silent_ms: f64,
    objects: usize,
    kept: usize,
    kept_share: f64,
    /// Stamps that were not after the one before.
    stamps_back: u32,
}

/// Runs the command.
///
/// # Errors
/// Where a process does not start, or no hub takes over.
pub async fn takeover(args: &TakeoverArgs) -> anyhow::Result<ExitCode> {
    let shutdown = shutdown::token(false)?;
    let report = tokio::select! {
        report = measure(args) => report?,
        () = shutdown.cancelled() => return Ok(ExitCode::from(130)),
    };
    let text = if args.json { format!("{}\n", serde_json::to_string(&report)?) } else { report.as_text() };
    crate::report::output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

async fn measure(args: &TakeoverArgs) -> anyhow::Result<TakeoverReport> {
    let program = std::env::current_exe().context("finding this program")?;
    let network = NetworkId::new(&format!("takeover-{}", clock::now().as_micros()))?;
    let mut launcher = Launcher::new(program, network);
    if let Some(logs) = &args.logs {
        std::fs::create_dir_all(logs).with_context(|| format!("making {}", logs.display()))?;
        launcher = launcher.with_logs(logs, "info");
    }
    let scenario = Scenario::load(&args.scenario)?;
    let mut pair = Pair::start(&launcher).await?;
    let agents =
        pair.agents(&launcher, &args.scenario, scenario.agents.iter().map(|agent| agent.id())).await?;
    let mut takeovers = Vec::new();
    for number in 1..=args.times {
        pair.until_followed().await?;
        let first = pair.kill_publishing().await?;
        let later = pair.list_after(first.next.frame.fused_at + Span::from_millis(2_000)).await?;
        let ids = first.next.frame.objects.iter().map(|object| object.track);
        let is_there = |id| later.frame.objects.iter().any(|object| object.track == id);
        let there = ids.filter(|id| is_there(*id)).count();
        let restarted_at = clock::now();
        pair.restart(&launcher).await?;
        let takeover = Takeover {
            silent_ms: (first.next.received_at - first.last.received_at).as_millis_f64(),
            since_kill_ms: (first.next.received_at - first.killed_at).as_millis_f64(),
            objects: first.last.frame.objects.len(),
            kept: kept_ids(&first.last.frame, &first.next.frame),
            kept_2s: there as f64 / first.next.frame.objects.len().max(1) as f64,
            restart_ms: (clock::now() - restarted_at).as_millis_f64(),
        };
        tracing::info!(number, ?takeover);
        takeovers.push(takeover);
    }
    for agent in agents {
        agent.end("stopped").await?;
    }
    let stamps_back = pair.end().await?;
    Ok(TakeoverReport::of(takeovers, stamps_back))
}

impl TakeoverReport {
    fn of(takeovers: Vec<Takeover>, stamps_back: u32) -> Self {
        let sum = |count: fn(&Takeover) -> usize| takeovers.iter().map(count).sum::<usize>();
        let (objects, kept) = (sum(|one| one.objects), sum(|one| one.kept));
        Self {
            worst_silent_ms: takeovers.iter().map(|one| one.silent_ms).fold(0.0, f64::max),
            objects,
            kept,
            kept_share: kept as f64 / objects.max(1) as f64,
            stamps_back,
            takeovers,
        }
    }

    fn as_text(&self) -> String {
        let mut silent: Vec<_> = self.takeovers.iter().map(|one| one.silent_ms).collect();
        silent.sort_by(f64::total_cmp);
        let restarts = self.takeovers.iter().map(|one| one.restart_ms).fold(0.0, f64::max);
        let later = self.takeovers.iter().map(|one| one.kept_2s).sum::<f64>() / silent.len() as f64;
        format!(
            "{} takeovers\n\
             without a list  median {:.0} ms, at most {:.0} ms (last list of the one to first list of the other)\n\
             ids             {} of {} kept, {:.2} %; {:.2} % of them two seconds later\n\
             stamps          {} not after the one before\n\
             restart         at most {restarts:.0} ms until the killed hub was ready to stand by\n",
            silent.len(),
            silent[silent.len() / 2],
            self.worst_silent_ms,
            self.kept,
            self.objects,
            100.0 * self.kept_share,
            100.0 * later,
            self.stamps_back,
        )
    }
}
