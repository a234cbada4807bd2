//! The command line of the replay.

use std::path::PathBuf;
use v2x_common::duration::parse_seconds;
use v2x_common::id::NetworkId;
use v2x_common::net::endpoint_given::to_connect;
use v2x_common::net::session::SessionOptions;

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x hub --network again &  v2x replay run.mcap --network again
                             the frames of a recording through a new hub
  v2x replay run.mcap --network again --loop
                             over and over
  v2x replay run.mcap --network again --from 30s --speed 2
                             from 30 s on, twice as fast
Frames, descriptions and truth are sent, with their spacing and with stamps of
today; lists of hubs are not.")]
pub(crate) struct ReplayArgs {
    /// The recording
    pub(crate) file: PathBuf,
    /// The network to send to [default: the recorded one]
    #[arg(long)]
    pub(crate) network: Option<NetworkId>,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    pub(crate) connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    pub(crate) zenoh_config: Option<PathBuf>,
    /// How many times as fast as recorded; objects are as many times as fast
    #[arg(long, default_value_t = 1.0, value_name = "X", value_parser = speed)]
    pub(crate) speed: f64,
    /// Begin so long after the first message; a plain number is seconds
    #[arg(long, default_value = "0s", value_name = "DURATION", value_parser = parse_seconds)]
    pub(crate) from: f64,
    /// Again and again, until Ctrl-C. At each new beginning everything jumps back to its first place, and gets new ids
    #[arg(long = "loop")]
    pub(crate) is_loop: bool,
    /// Send the recorded bytes as they are: hubs refuse such frames as too late
    #[arg(long)]
    pub(crate) keep_stamps: bool,
    /// How long to wait for a hub
    #[arg(long, default_value = "10s", value_name = "DURATION", value_parser = parse_seconds)]
    pub(crate) wait: f64,
}

impl ReplayArgs {
    /// How to reach the network.
    pub(crate) fn session_options(&self) -> SessionOptions {
        SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: Vec::new(),
        }
    }
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    if (0.01..=100.0).contains(&speed) { Ok(speed) } else { Err("must be from 0.01 to 100".into()) }
}
