//! The agent's command line.

use crate::scenario::WorldSource;
use std::path::PathBuf;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::net::endpoint_given::to_connect;
use v2x_common::net::session::SessionOptions;

/// How frames become bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum WireFormat {
    /// Compact, the default
    #[default]
    Postcard,
    /// Readable, for people and other languages
    Json,
}

/// Run one agent of a scenario: observe its world, and publish detections over its link.
///
/// Agents that are started separately use the same world time: the Unix time, rounded down to a multiple of the
/// scenario's loop.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x agent --scenario crossing --id ego
  v2x agent --scenario crossing --id rsu --connect tcp/192.168.1.10:7447
  v2x agent --scenario crossing --id ego --format json
        readable with any Zenoh client
  v2x agent --scenario crossing --id ego \\
            --zenoh-config certs/agent/ego/zenoh.json5   by its certificate
  v2x agent --scenario crossing --id ego --world sumo:my.sumocfg
                                     beside: v2x sumo my.sumocfg
The program `agent` is the same agent as a program of its own.")]
pub struct AgentArgs {
    /// The scenario file
    #[arg(long, value_name = "FILE")]
    pub scenario: PathBuf,
    /// Another world for the scenario: sumo:CFG, which v2x up or v2x sumo publishes on this network
    #[arg(long, value_name = "sumo:CFG")]
    pub world: Option<WorldSource>,
    /// Which agent of the scenario to run
    #[arg(long)]
    pub id: AgentId,
    /// The network to join
    #[arg(long, default_value = "demo")]
    pub network: NetworkId,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    pub connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    pub zenoh_config: Option<PathBuf>,
    /// Seed of the world and of all noise [default: the scenario's]
    #[arg(long, value_parser = v2x_common::seed::parse_seed)]
    pub seed: Option<u64>,
    /// Unix time in µs at which scenario time is 0 [default: now, rounded down to the scenario's loop; that of the first world heard, if SUMO drives it]
    #[arg(long, value_name = "MICROSECONDS")]
    pub start: Option<i64>,
    /// How frames become bytes
    #[arg(long, value_enum, default_value_t)]
    pub format: WireFormat,
    /// Print life-cycle events as JSON lines on standard output
    #[arg(long, hide = true)]
    pub events: bool,
    /// End when standard input does (for children of a launcher)
    #[arg(long, hide = true)]
    pub exit_with_stdin: bool,
}

impl AgentArgs {
    /// The network options.
    pub fn session_options(&self) -> SessionOptions {
        SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: Vec::new(),
        }
    }
}
