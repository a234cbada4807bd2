//! `v2x`: one command for a cooperative-perception network.

mod certs;
mod check;
mod completions;
mod demo;
mod foxglove;
mod health;
mod links;
mod network;
mod output;
mod proxy;
mod record;
mod recorded;
mod replay;
mod runs;
mod scenario;
mod scenarios;
mod served;
mod status;
mod sumo;
mod sumo_home;
mod up;
mod watch;
mod web;
mod world;

use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;
use v2x_agent::shell::AgentArgs;
use v2x_common::net::{logging, shutdown};
use v2x_fusion_hub::hub::HubArgs;

/// Cooperative perception over a network: agents publish what they detect, a hub fuses it, consumers read one list.
#[derive(Parser)]
#[command(
    name = "v2x",
    version = v2x_common::version::LONG,
    max_term_width = 80,
    after_help = "\
Examples:
  v2x demo                        a hub, an ego vehicle, a roadside unit and a
                                  consumer; prints what fusion gains
  v2x up highway                  a whole network until Ctrl-C
  v2x demo --web                  the same in your browser, until Ctrl-C
  v2x watch                       the fused objects, live
  v2x watch --json | jq .objects  the same for pipes
  v2x check                       what looks wrong, and which line to change
  v2x record run.mcap             everything on a network, to be replayed and
                                  computed again
  v2x world traffic.csv           what is in recorded traffic, which can be the
                                  world of a network
  v2x scenario init               a commented scenario file, to begin one of
                                  your own
  v2x runs                        earlier runs with their verdicts
  v2x links                       the named links of scenarios, with their
                                  delays and losses
  v2x certs init                  only your own machines: TLS, and who may
                                  publish what
  v2x proxy --link lte-uu         a slow TCP link in front of a hub, for
                                  programs that are not ours"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// What to log (default: life cycle and warnings): a level, or a filter such as warn,v2x_fusion_hub=debug
    #[arg(long, global = true, default_value = logging::DEFAULT_FILTER, hide_default_value = true, value_name = "FILTER")]
    log: String,
    /// How to log: text for people, json for machines
    #[arg(long, global = true, default_value_t, value_name = "FORMAT")]
    log_format: logging::Format,
}

impl Cli {
    /// What is logged. These commands say in a sentence of their own why they are not connected: Zenoh's say less, with places in
    /// its code.
    fn filter(&self) -> String {
        let says_it_itself = matches!(self.command, Command::Check(_) | Command::Status(_));
        if says_it_itself && self.log == logging::DEFAULT_FILTER {
            return format!("{},zenoh::net::runtime=off", self.log);
        }
        self.log.clone()
    }
}

#[derive(Subcommand)]
enum Command {
    /// Run a small network for a limited time, and print what fusion gains
    Demo(demo::DemoArgs),
    /// Run a whole network from a scenario file until Ctrl-C
    Up(up::UpArgs),
    /// Print or record the fused objects of a network, live
    Watch(watch::WatchArgs),
    /// Record a network into an MCAP file, with the journals of its hubs
    Record(record::RecordArgs),
    /// Put the frames of a recording on a network again
    Replay(replay::ReplayArgs),
    Check(check::CheckArgs),
    /// Print the status of the hubs and of their agents, and what looks wrong
    Status(status::StatusArgs),
    Certs(certs::CertsArgs),
    World(world::WorldArgs),
    Scenario(scenario::ScenarioArgs),
    Sumo(sumo::SumoArgs),
    Runs(runs::RunsArgs),
    Links(links::LinksArgs),
    Proxy(proxy::ProxyArgs),
    Completions(completions::CompletionsArgs),
    Man(completions::ManArgs),
    /// Run only a hub
    Hub(HubArgs),
    /// Run only one agent of a scenario
    Agent(AgentArgs),
}

#[tokio::main]
async fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = async {
        logging::init(&cli.filter(), cli.log_format)?;
        match cli.command {
            Command::Demo(args) => demo::run(&args, &cli.log, &shutdown::token(false)?).await,
            Command::Up(args) => {
                up::run(&args, &cli.log, &shutdown::token(false)?).await.map(|()| ExitCode::SUCCESS)
            }
            Command::Watch(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                watch::run(&args, &shutdown).await.map(|()| ExitCode::SUCCESS)
            }
            Command::Record(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                record::run(&args, &shutdown).await.map(|()| ExitCode::SUCCESS)
            }
            Command::Replay(args) => {
                replay::run(&args, &shutdown::token(false)?).await.map(|()| ExitCode::SUCCESS)
            }
            Command::Status(args) => status::run(&args, &shutdown::token(false)?).await,
            Command::Check(args) => check::run(&args, &shutdown::token(false)?).await,
            Command::Proxy(args) => {
                proxy::run(&args, &shutdown::token(false)?).await.map(|()| ExitCode::SUCCESS)
            }
            Command::Certs(args) => certs::run(&args).map(|()| ExitCode::SUCCESS),
            Command::World(args) => world::run(&args).map(|()| ExitCode::SUCCESS),
            Command::Scenario(args) => scenario::run(&args).map(|()| ExitCode::SUCCESS),
            Command::Sumo(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                sumo::run(&args, &shutdown).await.map(|()| ExitCode::SUCCESS)
            }
            Command::Runs(args) => runs::run(&args).map(|()| ExitCode::SUCCESS),
            Command::Completions(args) => {
                completions::completions(&args, Cli::command()).map(|()| ExitCode::SUCCESS)
            }
            Command::Man(args) => completions::man(&args, Cli::command()).map(|()| ExitCode::SUCCESS),
            Command::Links(args) => links::run(&args).map(|()| ExitCode::SUCCESS),
            Command::Hub(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                v2x_fusion_hub::hub::run(args, shutdown).await.map(|()| ExitCode::SUCCESS)
            }
            Command::Agent(args) => {
                let shutdown = shutdown::token(args.exit_with_stdin)?;
                v2x_agent::shell::run(args, shutdown).await.map(|()| ExitCode::SUCCESS)
            }
        }
    };
    v2x_common::net::exit_code("v2x", outcome.await)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_help_has_examples_and_fits_eighty_columns() {
        assert_eq!(v2x_lab::commands::help::faults(Cli::command()), [""; 0]);
    }
}
