//! `lab simulate`: runs a scenario in virtual time and scores it.

use crate::commands::remarks::log_remarks;
use crate::commands::run_folder::print_summary;
use crate::data::simulation::Simulation;
use crate::drive::virtual_run::VirtualRun;
use crate::score::run::scored_run::RunFacts;
use crate::score::run::simulated::score_in_world;
use crate::score::run::summary::Verdict;
use anyhow::{Context, ensure};
use std::path::PathBuf;
use v2x_agent::scenario::Scenario;
use v2x_common::duration::parse_seconds;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::hub::HubSettings;

/// Run a scenario in virtual time (no network, no waiting, bit-reproducible), and score it
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab simulate crossing                   a shipped scenario, for a minute
  lab simulate mine.toml --duration 10min --seed 7
  lab simulate latency --method csba-wls  by another method

The exit code is 1 where the published objects are not the true ones: none is
matched, or recall or precision on the objects that all agents cover is below
0.8 (0.2 where a method is chosen) and below the best agent's.")]
pub struct SimulateArgs {
    /// The scenario file, or a shipped scenario's name
    scenario: PathBuf,
    /// How long the agents capture
    #[arg(long = "duration", alias = "duration-s", default_value = "60s", value_name = "DURATION", value_parser = parse_seconds)]
    duration_s: f64,
    /// The method, by its key in deploy/docs/methods.md [default: the scenario's]
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// Seed of the world and of all noise [default: the scenario's]
    #[arg(long, value_parser = v2x_common::seed::parse_seed)]
    seed: Option<u64>,
    /// Print the summary as one line of JSON
    #[arg(long)]
    json: bool,
}

/// An arbitrary start: the world depends on scenario time only.
const START: Timestamp = Timestamp::from_nanos(1_700_000_000_000_000_000);

/// Runs and scores.
pub fn simulate(args: &SimulateArgs) -> anyhow::Result<()> {
    let scenario = Scenario::load(&args.scenario)?;
    scenario.check_known("lab simulate")?;
    log_remarks(&scenario);
    let mut table = scenario.hub.clone();
    if let Some(method) = &args.method {
        table.insert("method".to_owned(), method.clone().into());
    }
    let is_method_chosen = table.contains_key("method");
    let settings = HubSettings::from_table(table)?;
    let seed = args.seed.unwrap_or(scenario.seed);
    let duration = Span::from_secs_f64(args.duration_s);
    let run = VirtualRun { scenario: &scenario, seed, start: START, duration, settings: &settings };
    let log = run.run(Engine::new(settings.engine)).context("simulating")?;
    let simulation = Simulation::new(&scenario, seed, START);
    let sent = |agent: &_| {
        let frames = log.detections.iter().filter(|received| received.frame.id.agent == *agent);
        Some(frames.count() as u64)
    };
    let facts = RunFacts {
        scenario: scenario.name.clone(),
        seed,
        duration_s: args.duration_s,
        processes: 1,
        agents: simulation.agent_facts(sent),
        latency_ms: None,
        compute_ms: None,
    };
    let summary = score_in_world(&simulation, &log, &facts)?.summary;
    print_summary(&summary, args.json)?;
    let verdict = Verdict::of_objects(&summary.fused, &summary.agents, is_method_chosen);
    ensure!(
        verdict.passed,
        "{}. What the scenario says of [hub], and of [hub.agents.NAME], is how frames are read: a wrong frame, unit or time puts objects \
         where none is",
        verdict.reasons.join("; ")
    );
    Ok(())
}
