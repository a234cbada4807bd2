//! `lab`: the laboratory's command line.

use clap::{Parser, Subcommand};
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};
use std::alloc::System;
use std::process::ExitCode;
use v2x_agent::shell::AgentArgs;
use v2x_common::net::{logging, shutdown};
use v2x_fusion_hub::hub::{self, HubArgs};

/// Counts allocations, for `lab throughput`.
#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn heap() -> v2x_lab::commands::Heap {
    let stats = ALLOCATOR.stats();
    v2x_lab::commands::Heap {
        allocations: (stats.allocations + stats.reallocations) as u64,
        bytes: (stats.bytes_allocated - stats.bytes_deallocated) as u64,
    }
}

/// Measure cooperative-perception networks.
#[derive(Parser)]
#[command(
    name = "lab",
    version = v2x_common::version::LONG,
    max_term_width = 80,
    after_help = "\
Examples:
  lab simulate crossing --duration 60s --seed 7
  lab throughput --agents 200 --late 0.2  how many detections one core fuses
  lab load --agents 200                   what a live hub takes, and with an
                                          agent that misbehaves
  lab takeover                            how fast a standby hub takes over, and
                                          how many ids it keeps
  lab tables --quick                      the paper's tables
  lab sweep latency                       error against delay, for every method
                                          of handling it
  lab fuse --detections log.csv --out fused.csv
                                          your own detections through the hub's
                                          engine
  lab export --quick --out detections     the detections of the tables, for a
                                          method of your own
  lab score --name mine fused --export detections
                                          its row in the tables
  lab report v2x-runs/2026-11-28_14-05-31-crossing
                                          one page of a run that v2x demo
                                          recorded
  lab score v2x-runs/2026-11-28_14-05-31-crossing
                                          a run that v2x demo recorded
  lab rerun v2x-runs/2026-11-28_14-05-31-crossing --method csba-wls
                                          its frames through another method
  lab retrack run.mcap                    a recorded hub again, compared bit by
                                          bit"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// What to log (default: life cycle and warnings): a level, or a filter such as warn,v2x_lab=debug
    #[arg(long, global = true, default_value = logging::DEFAULT_FILTER, hide_default_value = true, value_name = "FILTER")]
    log: String,
    /// How to log: text for people, json for machines
    #[arg(long, global = true, default_value_t, value_name = "FORMAT")]
    log_format: logging::Format,
}

#[derive(Subcommand)]
enum Command {
    Export(v2x_lab::commands::ExportArgs),
    Fuse(v2x_lab::commands::FuseArgs),
    Load(v2x_lab::commands::LoadArgs),
    Rerun(v2x_lab::commands::RerunArgs),
    Retrack(v2x_lab::commands::RetrackArgs),
    Report(v2x_lab::commands::ReportArgs),
    Score(v2x_lab::commands::ScoreArgs),
    Simulate(v2x_lab::commands::SimulateArgs),
    Sweep(v2x_lab::commands::SweepArgs),
    Tables(v2x_lab::commands::TablesArgs),
    Takeover(v2x_lab::commands::TakeoverArgs),
    Throughput(v2x_lab::commands::ThroughputArgs),
    #[command(hide = true)]
    Hub(HubArgs),
    #[command(hide = true)]
    Agent(AgentArgs),
}

#[tokio::main]
async fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = async {
        logging::init(&cli.log, cli.log_format)?;
        let done: anyhow::Result<()> = match cli.command {
            Command::Export(args) => v2x_lab::commands::export(&args),
            Command::Fuse(args) => v2x_lab::commands::fuse(&args),
            Command::Load(args) => return v2x_lab::commands::load(&args).await,
            Command::Rerun(args) => v2x_lab::commands::rerun(&args),
            Command::Retrack(args) => return v2x_lab::commands::retrack(&args),
            Command::Report(args) => v2x_lab::commands::report(&args),
            Command::Score(args) => v2x_lab::commands::score(&args),
            Command::Simulate(args) => v2x_lab::commands::simulate(&args),
            Command::Sweep(args) => return v2x_lab::commands::sweep(&args).await,
            Command::Tables(args) => v2x_lab::commands::tables(&args),
            Command::Takeover(args) => return v2x_lab::commands::takeover(&args).await,
            Command::Throughput(args) => v2x_lab::commands::throughput(&args, heap),
            Command::Hub(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                hub::run(args, shutdown).await
            }
            Command::Agent(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                v2x_agent::shell::run(args, shutdown).await
            }
        };
        done.map(|()| ExitCode::SUCCESS)
    };
    v2x_common::net::exit_code("lab", outcome.await)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn every_help_has_examples_and_fits_eighty_columns() {
        assert_eq!(v2x_lab::commands::help::faults(Cli::command()), [""; 0]);
    }
}
