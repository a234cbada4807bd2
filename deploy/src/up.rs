//! `v2x up`: a whole network until Ctrl-C.

use crate::network::{AgentsOfRun, FinalReports, Network, STARTING_SUMO, end_consumer};
use crate::scenarios::{self, Chosen};
use crate::web::{Scene, Site, Source, WebArgs};
use anyhow::{Context, anyhow, bail};
use std::convert::Infallible;
use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use tokio_util::sync::CancellationToken;
use v2x_agent::scenario::{Scenario, WorldSource};
use v2x_common::clock;
use v2x_common::id::NetworkId;
use v2x_common::net::endpoint_given::to_listen;
use v2x_common::net::session::{DEFAULT_ENDPOINT, SessionOptions};
use v2x_fusion_hub::hub::metrics;
use v2x_lab::commands::RunFolder;
use v2x_lab::loopback::{Child, ChildError, HubOptions, Launcher};

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x up crossing                    then, in another terminal: v2x watch
  v2x up crossing --web              in your browser, at http://127.0.0.1:8088/
  v2x up crossing --record run.mcap  records all of it, for v2x replay and lab
                                     retrack
  v2x up my-scenario.toml --seed 7
  v2x up my-sumo.toml --world sumo:my.sumocfg
                                     SUMO is the world, live
  v2x up highway --listen tcp/0.0.0.0:7447
                                     for consumers and agents on other machines")]
pub(crate) struct UpArgs {
    /// A scenario file, or the name of a shipped scenario
    #[arg(value_name = "SCENARIO")]
    scenario: String,
    /// Another world for the scenario: sumo:CFG runs SUMO, traci:HOST:PORT takes a SUMO that is running
    #[arg(long, value_name = "sumo:CFG")]
    world: Option<WorldSource>,
    /// The network's name
    #[arg(long, default_value = "demo")]
    network: NetworkId,
    /// Where the hub listens
    #[arg(long, value_name = "ENDPOINT", default_value = DEFAULT_ENDPOINT, value_parser = to_listen)]
    listen: String,
    /// Seed of the world and of all noise [default: the scenario's]
    #[arg(long, value_parser = v2x_common::seed::parse_seed)]
    seed: Option<u64>,
    /// Where the run's folder with the logs is made [default: v2x-runs/TIME-SCENARIO]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Record the network into an MCAP file
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Overwrite the recording if it exists
    #[arg(long, requires = "record")]
    force: bool,
    /// Serve the hub's metrics for Prometheus and its health at this address [default: 127.0.0.1:9464]
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = metrics::DEFAULT,
          value_parser = metrics::parse)]
    metrics: Option<SocketAddr>,
    #[command(flatten)]
    web: WebArgs,
}

impl UpArgs {
    fn hub_options(&self, config: &Path) -> HubOptions {
        HubOptions {
            listen: self.listen.clone(),
            config: Some(config.to_owned()),
            metrics: self.metrics,
            ..HubOptions::default()
        }
    }
}

impl UpArgs {
    /// Starts the hub, and the recorder where one is wanted.
    async fn start(
        &self,
        launcher: &Launcher,
        config: &Path,
        belongings: Vec<String>,
    ) -> Result<(Network, Option<Child>), ChildError> {
        let network = Network::start_hub(launcher, &self.hub_options(config)).await?;
        let Some(file) = &self.record else { return Ok((network, None)) };
        let mut options = vec![file.display().to_string(), "--connect".to_owned(), network.locator.clone()];
        options.extend(self.force.then(|| "--force".to_owned()));
        options.extend(belongings);
        let (recorder, _) = launcher.start("recorder", "record", &options).await?;
        Ok((network, Some(recorder)))
    }
}

/// Runs the network until shutdown, or until one of its processes ends.
pub(crate) async fn run(args: &UpArgs, log_filter: &str, shutdown: &CancellationToken) -> anyhow::Result<()> {
    let chosen = scenarios::choose_in(&args.scenario, args.world.as_ref())?;
    let site = Site::listen_if_wanted(args.web.web)?;
    if let Some(file) = args.record.as_ref().filter(|file| file.exists() && !args.force) {
        bail!("{} exists; choose another name, or give --force to overwrite it", file.display());
    }
    let now = clock::now();
    let folder = RunFolder::create(args.out.as_deref(), &chosen.scenario.name)?;
    chosen.write(&folder)?;
    let program = std::env::current_exe().context("finding this program")?;
    let launcher = Launcher::new(program, args.network).with_logs(&folder.logs(), log_filter);
    let file = folder.scenario();
    let mut run = AgentsOfRun {
        scenario: &chosen.scenario,
        file: &file,
        seed: args.seed.unwrap_or(chosen.scenario.seed),
        start: chosen.start(now),
    };
    let belongings = belongings(&chosen, &folder, &run)?;
    let (mut network, mut recorder) = tokio::select! {
        started = args.start(&launcher, &file, belongings) => started?,
        () = shutdown.cancelled() => return Ok(()),
    };
    let world = chosen.sumo(&folder).inspect(|_| print_line(STARTING_SUMO));
    if !network.start_world_and_agents(&launcher, world, &mut run, shutdown).await? {
        return Ok(());
    }
    say_up(&chosen.scenario, &network.locator, (&folder, args.network));
    let live = site.map(|site| {
        site.announce();
        let connect = vec![network.locator.clone()];
        let session = SessionOptions { connect, ..SessionOptions::default() };
        let scene = Some(Scene::new(run.scenario, run.seed, run.start));
        site.serve(Source { session, network: args.network, hub: None, scene })
    });
    let exit = tokio::select! {
        error = network.first_exit() => Some(error),
        () = shutdown.cancelled() => None,
        never = say_if_recording_ends(recorder.as_mut()) => match never {},
    };
    if let Some(live) = live {
        live.end().await?;
    }
    let mut reports = FinalReports::default();
    network.end_agents(&mut reports).await;
    network.end_world(&mut reports).await;
    if let Some(recorder) = recorder {
        end_consumer(recorder, &mut reports).await;
    }
    network.end_hub(&mut reports).await;
    chosen.keep_world(&folder)?;
    match (exit, reports.failures.is_empty()) {
        (Some(error), _) => Err(error.into()),
        (None, false) => Err(anyhow!("{}", reports.failures.join("; "))),
        (None, true) => {
            print_line("all processes have ended");
            Ok(())
        }
    }
}

fn say_up(scenario: &Scenario, locator: &str, (folder, network): (&RunFolder, NetworkId)) {
    print_line(&format!(
        "{} is up: hub at {locator}, {} agents; logs in {}\nwatch it with: v2x watch --network {network} --connect {locator}\nCtrl-C ends it",
        scenario.name,
        scenario.agents.len(),
        folder.logs().display(),
    ));
}

/// Options of the recorder: what makes a run of its recording, which can be scored later, and elsewhere.
fn belongings(chosen: &Chosen, folder: &RunFolder, run: &AgentsOfRun<'_>) -> anyhow::Result<Vec<String>> {
    let mut options = Vec::new();
    for name in chosen.belongings(folder)? {
        options.extend(["--attach".to_owned(), format!("{name}={}", folder.path().join(&name).display())]);
    }
    if options.is_empty() {
        return Ok(options);
    }
    let facts = [
        ("seed", run.seed.to_string()),
        ("start_us", run.start.as_micros().to_string()),
        ("processes", (run.scenario.agents.len() + 2).to_string()),
    ];
    options
        .extend(facts.into_iter().flat_map(|(key, value)| ["--fact".to_owned(), format!("{key}={value}")]));
    Ok(options)
}

/// Says it where the recording ends before the network does.
async fn say_if_recording_ends(recorder: Option<&mut Child>) -> Infallible {
    if let Some(recorder) = recorder {
        while recorder.next_event().await.is_some() {}
        let error = recorder.ended_before("asked to end").await;
        print_line(&format!("NOT RECORDED from here on, the network goes on: {error}"));
    }
    std::future::pending().await
}

fn print_line(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
