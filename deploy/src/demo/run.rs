//! One demo: start, watch, end, score.

use super::DemoArgs;
use super::progress::Progress;
use crate::network::{AgentsOfRun, LastWords, Network, end_consumer};
use crate::scenarios::{self, Chosen};
use anyhow::Context;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::NetworkId;
use v2x_common::time::{Span, Timestamp};
use v2x_lab::Summary;
use v2x_lab::commands::{RunFolder, RunRecord, print_summary};
use v2x_lab::loopback::{Child, Launcher};

/// The exit code of a program that Ctrl-C ended (128 + SIGINT).
const INTERRUPTED: u8 = 130;

/// Runs the demo; the exit code tells whether fusion gained what it should.
pub(crate) async fn run(
    args: &DemoArgs,
    log_filter: &str,
    shutdown: &CancellationToken,
) -> anyhow::Result<ExitCode> {
    let chosen = scenarios::choose(&args.scenario)?;
    let started_at = clock::now();
    let folder = RunFolder::create(&args.out.clone().unwrap_or_else(|| default_folder(&chosen, started_at)))?;
    folder.write("scenario.toml", &chosen.text)?;
    let demo = Demo {
        args,
        seed: args.seed.unwrap_or(chosen.scenario.seed),
        launcher: launcher(started_at)?.with_logs(&folder.logs(), log_filter),
        chosen,
        folder,
    };
    let Some(record) = demo.run(shutdown).await? else {
        return Ok(ExitCode::from(INTERRUPTED));
    };
    demo.folder.write_record(&record)?;
    let summary = demo.folder.score().with_context(|| {
        let scoring = format!("scoring the run in {}", demo.folder.path().display());
        record.failures.iter().cloned().chain([scoring]).collect::<Vec<_>>().join("\n")
    })?;
    demo.report(&summary)?;
    Ok(if summary.verdict.passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// A network of its own name: two demos on one machine do not meet.
fn launcher(started_at: Timestamp) -> anyhow::Result<Launcher> {
    let program = std::env::current_exe().context("finding this program")?;
    let network = NetworkId::new(&format!("demo-{}", started_at.as_micros()))?;
    Ok(Launcher::new(program, network))
}

fn default_folder(chosen: &Chosen, started_at: Timestamp) -> PathBuf {
    // To the microsecond: runs that a script starts side by side keep apart.
    PathBuf::from("v2x-runs").join(format!("{}-{}", started_at.as_micros(), chosen.scenario.name))
}

struct Demo<'a> {
    args: &'a DemoArgs,
    chosen: Chosen,
    seed: u64,
    folder: RunFolder,
    launcher: Launcher,
}

/// A network that runs, and when its scenario began.
struct Started {
    network: Network,
    consumer: Child,
    start: Timestamp,
}

impl Demo<'_> {
    /// Runs the network; `None` where Ctrl-C came first. Whatever happens, every process has ended after it.
    async fn run(&self, shutdown: &CancellationToken) -> anyhow::Result<Option<RunRecord>> {
        let mut progress = Progress::new(self.args.duration);
        let n_agents = self.chosen.scenario.agents.len();
        progress.say(&format!(
            "{}: starting a hub, {n_agents} agents and a consumer as {} processes on this machine",
            self.chosen.scenario.name,
            n_agents + 2,
        ));
        let scenario_file = self.folder.scenario();
        let record = self.run_network(&scenario_file, &mut progress, shutdown).await?;
        if record.is_none() {
            progress.say("interrupted; all processes have ended");
        }
        Ok(record)
    }

    async fn run_network(
        &self,
        scenario_file: &std::path::Path,
        progress: &mut Progress,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<Option<RunRecord>> {
        // During the start, Ctrl-C drops and so kills what has been started; after it, all end in order.
        let started = tokio::select! {
            started = self.start_network(scenario_file) => started?,
            () = shutdown.cancelled() => return Ok(None),
        };
        let Started { mut network, mut consumer, start } = started;
        progress.say(&format!("hub at {}, all processes are up", network.locator));
        let began_at = clock::now();
        let death = tokio::select! {
            death = self.watch(&mut network, &mut consumer, progress) => death,
            () = shutdown.cancelled() => None,
        };
        progress.end();
        let duration_s = (clock::now() - began_at).as_secs_f64();
        let mut words = LastWords::default();
        words.failures.extend(death);
        network.end_agents(&mut words).await;
        end_consumer(consumer, &mut words).await;
        network.end_hub(&mut words).await;
        if shutdown.is_cancelled() {
            return Ok(None);
        }
        Ok(Some(RunRecord {
            seed: self.seed,
            start_us: start.as_micros(),
            duration_s,
            processes: self.chosen.scenario.agents.len() + 2,
            frames_sent: words.frames_sent,
            hub: words.hub,
            failures: words.failures,
        }))
    }

    async fn start_network(&self, scenario_file: &std::path::Path) -> anyhow::Result<Started> {
        let mut network = Network::start_hub(&self.launcher, "tcp/127.0.0.1:0", scenario_file).await?;
        let consumer = self.start_consumer(&network.locator).await?;
        let start = clock::now();
        let run =
            AgentsOfRun { scenario: &self.chosen.scenario, file: scenario_file, seed: self.seed, start };
        network.start_agents(&self.launcher, &run).await?;
        Ok(Started { network, consumer, start })
    }

    async fn start_consumer(&self, locator: &str) -> anyhow::Result<Child> {
        let record = self.folder.recording().display().to_string();
        let args = ["--connect", locator, "--record", &record].map(str::to_owned);
        Ok(self.launcher.start("consumer", "watch", &args).await?.0)
    }

    /// Shows progress for the run's duration; tells which process ended meanwhile, if one did.
    async fn watch(
        &self,
        network: &mut Network,
        consumer: &mut Child,
        progress: &mut Progress,
    ) -> Option<String> {
        let began_at = clock::now();
        let end = tokio::time::sleep(self.args.duration);
        tokio::pin!(end);
        loop {
            tokio::select! {
                () = &mut end => return None,
                error = network.first_death() => return Some(error.to_string()),
                event = consumer.next_event() => match event {
                    Some(event) => progress.show(since(began_at), &event),
                    None => return Some(consumer.ended_before("told to end").await.to_string()),
                }
            }
        }
    }

    fn report(&self, summary: &Summary) -> anyhow::Result<()> {
        print_summary(summary, self.args.json)?;
        let folder = self.folder.path().display();
        Progress::new(Duration::ZERO).say(&format!("report: {folder}/report.md, picture: {folder}/bev.svg"));
        Ok(())
    }
}

fn since(start: Timestamp) -> Duration {
    (clock::now() - start).max(Span::ZERO).to_duration()
}
