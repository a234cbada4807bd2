//! One demo: start the network, watch it, end it, score the recording.

use super::DemoArgs;
use super::progress::Progress;
use crate::network::{AgentsOfRun, FinalReports, Network, STARTING_SUMO, end_consumer};
use crate::output;
use crate::scenarios::{self, Chosen};
use crate::web::{Live, Scene, Site, Source};
use anyhow::{Context, bail};
use std::process::ExitCode;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::NetworkId;
use v2x_common::net::session::SessionOptions;
use v2x_common::time::{Span, Timestamp};
use v2x_lab::Summary;
use v2x_lab::commands::{RunFolder, RunRecord, print_summary};
use v2x_lab::loopback::{Child, HubOptions, Launcher};

/// The exit code of a program that Ctrl-C ended (128 + SIGINT).
const INTERRUPTED: u8 = 130;

/// Runs the demo; the exit code is 0 where the summary's verdict is "passed".
pub(crate) async fn run(
    args: &DemoArgs,
    log_filter: &str,
    shutdown: &CancellationToken,
) -> anyhow::Result<ExitCode> {
    let chosen = scenarios::choose_in(args.scenario(), args.world.as_ref())?;
    let site = Site::listen_if_wanted(args.web.web)?;
    if let Some(file) = args.record.as_ref().filter(|file| file.exists() && !args.force) {
        bail!("{} exists; choose another name, or give --force to overwrite it", file.display());
    }
    let started_at = clock::now();
    let folder = RunFolder::create(args.out.as_deref(), &chosen.scenario.name)?;
    chosen.write(&folder)?;
    let demo = Demo {
        args,
        seed: args.seed.unwrap_or(chosen.scenario.seed),
        launcher: launcher(started_at)?.with_logs(&folder.logs(), log_filter),
        chosen,
        folder,
    };
    let Some(record) = demo.run(site, shutdown).await? else {
        return Ok(ExitCode::from(INTERRUPTED));
    };
    demo.folder.write_record(&record)?;
    if let Some(file) = &args.record {
        std::fs::copy(demo.folder.recording(), file)
            .with_context(|| format!("copying the recording to {}", file.display()))?;
    }
    let summary = demo.folder.score().with_context(|| {
        let scoring = format!("scoring the run in {}", demo.folder.path().display());
        record.failures.iter().cloned().chain([scoring]).collect::<Vec<_>>().join("\n")
    })?;
    demo.report(&summary)?;
    Ok(if summary.verdict.passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Each demo has a network name of its own, so that two demos on one machine do not exchange data.
fn launcher(started_at: Timestamp) -> anyhow::Result<Launcher> {
    let program = std::env::current_exe().context("finding this program")?;
    let network = NetworkId::new(&format!("demo-{}", started_at.as_micros()))?;
    Ok(Launcher::new(program, network))
}

struct Demo<'a> {
    args: &'a DemoArgs,
    chosen: Chosen,
    seed: u64,
    folder: RunFolder,
    launcher: Launcher,
}

impl Demo<'_> {
    /// Runs the network; `None` where Ctrl-C came first. Every process has ended when it returns.
    async fn run(
        &self,
        site: Option<Site>,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<Option<RunRecord>> {
        let mut progress = Progress::new(self.args.length());
        let n_agents = self.chosen.scenario.agents.len();
        progress.print(&format!(
            "{}: starting a hub, {n_agents} agents and a consumer as {} processes on this machine",
            self.chosen.scenario.name,
            n_agents + 2,
        ));
        let scenario_file = self.folder.scenario();
        let record = self.run_network(site, &scenario_file, &mut progress, shutdown).await?;
        if record.is_none() {
            progress.print("interrupted; all processes have ended");
        }
        Ok(record)
    }

    async fn run_network(
        &self,
        site: Option<Site>,
        scenario_file: &std::path::Path,
        progress: &mut Progress,
        shutdown: &CancellationToken,
    ) -> anyhow::Result<Option<RunRecord>> {
        // During the start, Ctrl-C drops and so kills what has been started; later, all processes end in order.
        let started = tokio::select! {
            started = self.start_network(scenario_file) => started?,
            () = shutdown.cancelled() => return Ok(None),
        };
        let (mut network, mut consumer) = started;
        let world = self.chosen.sumo(&self.folder).inspect(|_| progress.print(STARTING_SUMO));
        let (scenario, start) = (&self.chosen.scenario, clock::now());
        let mut run = AgentsOfRun { scenario, file: scenario_file, seed: self.seed, start };
        if !network.start_world_and_agents(&self.launcher, world, &mut run, shutdown).await? {
            return Ok(None);
        }
        let start = run.start;
        progress.print(&format!("hub at {}, all processes are up", network.locator));
        let live = site.map(|site| self.show(site, &network.locator, start));
        let began_at = clock::now();
        let exit = tokio::select! {
            exit = self.watch(&mut network, &mut consumer, progress) => exit,
            () = shutdown.cancelled() => None,
        };
        progress.end();
        let ran = since(began_at);
        if let Some(live) = live {
            live.end().await?;
        }
        let mut reports = FinalReports::default();
        reports.failures.extend(exit);
        network.end_agents(&mut reports).await;
        network.end_world(&mut reports).await;
        end_consumer(consumer, &mut reports).await;
        network.end_hub(&mut reports).await;
        self.chosen.keep_world(&self.folder)?;
        if shutdown.is_cancelled() && !self.args.is_scored_after(ran) {
            return Ok(None);
        }
        Ok(Some(RunRecord {
            seed: self.seed,
            start_us: start.as_micros(),
            duration_s: ran.as_secs_f64(),
            processes: self.chosen.scenario.agents.len() + 2,
            frames_sent: reports.frames_sent,
            hub: reports.hub,
            failures: reports.failures,
        }))
    }

    /// Shows the network in a browser.
    fn show(&self, site: Site, locator: &str, start: Timestamp) -> Live {
        site.announce();
        if self.args.is_open_ended() {
            Progress::new(None).print("Ctrl-C ends it, and prints what fusion gains");
        }
        let session = SessionOptions { connect: vec![locator.to_owned()], ..SessionOptions::default() };
        let scene = Some(Scene::new(&self.chosen.scenario, self.seed, start));
        site.serve(Source { session, network: self.launcher.network(), hub: None, scene })
    }

    /// Starts the hub and the consumer.
    async fn start_network(&self, scenario_file: &std::path::Path) -> anyhow::Result<(Network, Child)> {
        let options = HubOptions { config: Some(scenario_file.to_owned()), ..HubOptions::default() };
        let network = Network::start_hub(&self.launcher, &options).await?;
        let consumer = self.start_consumer(&network.locator).await?;
        Ok((network, consumer))
    }

    async fn start_consumer(&self, locator: &str) -> anyhow::Result<Child> {
        let record = self.folder.recording().display().to_string();
        let args = [&record, "--connect", locator].map(str::to_owned);
        Ok(self.launcher.start("consumer", "record", &args).await?.0)
    }

    /// Shows progress for the run's duration; returns the error of a process that ended before its time.
    async fn watch(
        &self,
        network: &mut Network,
        consumer: &mut Child,
        progress: &mut Progress,
    ) -> Option<String> {
        let began_at = clock::now();
        let end = tokio::time::sleep(self.args.duration());
        tokio::pin!(end);
        loop {
            tokio::select! {
                () = &mut end => return None,
                error = network.first_exit() => return Some(error.to_string()),
                event = consumer.next_event() => match event {
                    Some(event) => progress.show(since(began_at), &event),
                    None => return Some(consumer.ended_before("asked to end").await.to_string()),
                }
            }
        }
    }

    fn report(&self, summary: &Summary) -> anyhow::Result<()> {
        // The verdict holds also where nothing reads the summary.
        output::output(print_summary(summary, self.args.json))?;
        let folder = self.folder.path().display();
        Progress::new(None)
            .print(&format!("report: {folder}/report.html (as text report.md), picture: {folder}/bev.svg"));
        Ok(())
    }
}

fn since(start: Timestamp) -> Duration {
    (clock::now() - start).max(Span::ZERO).to_duration()
}
