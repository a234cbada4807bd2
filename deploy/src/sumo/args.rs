//! The command line of `v2x sumo`.

use std::path::PathBuf;
use v2x_common::duration::parse_signed_seconds;
use v2x_common::id::NetworkId;
use v2x_common::net::endpoint_given::to_connect;
use v2x_common::net::session::SessionOptions;

/// Run SUMO as the world of a network, in real time; v2x up does it for a scenario with such a world
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
SUMO is found by SUMO_HOME, or as `sumo` on your PATH; pip install eclipse-sumo
installs it.

Examples:
  v2x up my.toml --world sumo:my.sumocfg
        hub, SUMO and agents at once
  v2x sumo my.sumocfg --connect tcp/192.168.1.10:7447
        only SUMO; agents by: v2x agent --world sumo:my.sumocfg …
  sumo-gui -c my.sumocfg --remote-port 8813 --start
  v2x sumo --traci 127.0.0.1:8813    beside it: SUMO that is running already")]
pub(crate) struct SumoArgs {
    /// SUMO's configuration (.sumocfg)
    #[arg(required_unless_present = "traci", conflicts_with = "traci")]
    pub(super) config: Option<PathBuf>,
    /// A SUMO that is running already, with --remote-port PORT
    #[arg(long, value_name = "HOST:PORT")]
    pub(super) traci: Option<String>,
    /// Begin at this time of SUMO, such as 600s or 10min (a plain number is seconds): until then it runs as fast as it can
    #[arg(long, value_name = "DURATION", value_parser = parse_signed_seconds)]
    pub(super) begin: Option<f64>,
    /// Write the world into a CSV file, which can be the world of a scenario later
    #[arg(long, value_name = "FILE")]
    pub(super) record: Option<PathBuf>,
    /// The network to join
    #[arg(long, default_value = "demo")]
    pub(super) network: NetworkId,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    pub(super) connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    pub(super) zenoh_config: Option<PathBuf>,
    /// Print life-cycle events as JSON lines on standard output
    #[arg(long, hide = true)]
    pub(super) events: bool,
    /// End when standard input does (for children of a launcher)
    #[arg(long, hide = true)]
    pub(crate) exit_with_stdin: bool,
}

impl SumoArgs {
    /// How to reach the network.
    pub(super) fn session_options(&self) -> SessionOptions {
        SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: Vec::new(),
        }
    }
}
