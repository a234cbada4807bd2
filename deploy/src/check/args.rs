//! The command line of `v2x check`.

use anyhow::Context;
use std::path::PathBuf;
use std::time::Duration;
use v2x_common::duration::parse_seconds;
use v2x_common::id::{AgentId, HubId, NetworkId};
use v2x_common::net::endpoint_given::{to_connect, to_listen};
use v2x_common::net::session::SessionOptions;
use v2x_fusion_hub::hub::{HubSettings, settings_of_file};

/// Listen, and say in sentences what looks wrong and which line to change
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x check                       every agent of the network, by its hub
  v2x check cam1                  one agent
  v2x check --connect tcp/192.168.1.10:7447
  v2x check --listen tcp/0.0.0.0:7447
                                  without a hub: in its place
  v2x check --hub north           what that hub says, whoever else does
  v2x check --json | jq '.findings[] | .code'

Exit code: 0 healthy, 1 degraded (or no connection), 2 wrong arguments,
3 no hub and no frame.")]
pub(crate) struct CheckArgs {
    /// The agent to look at [default: all]
    pub(super) agent: Option<AgentId>,
    /// The network of the agents
    #[arg(long, default_value = "demo")]
    pub(super) network: NetworkId,
    /// The hub or router to connect to; may be given more than once
    /// [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    connect: Vec<String>,
    /// Listen here in place of a hub; agents connect to this
    #[arg(long, value_name = "ENDPOINT", value_parser = to_listen, conflicts_with = "connect")]
    pub(super) listen: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,
    /// Believe this hub alone [default: every hub]
    #[arg(long, value_name = "NAME", conflicts_with = "listen")]
    pub(super) hub: Option<HubId>,
    /// A file with the settings by which frames are read where no hub answers
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// How long to listen
    #[arg(long, default_value = "10s", value_name = "DURATION", value_parser = parse_seconds)]
    duration: f64,
    /// How long to wait for a hub or router
    #[arg(long, default_value = "5s", value_name = "DURATION", value_parser = parse_seconds)]
    wait: f64,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

impl CheckArgs {
    pub(super) fn session(&self) -> SessionOptions {
        SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: self.listen.clone(),
        }
    }

    pub(super) fn duration(&self) -> anyhow::Result<Duration> {
        Duration::try_from_secs_f64(self.duration).context("--duration is no number of seconds")
    }

    pub(super) fn wait(&self) -> anyhow::Result<Duration> {
        Duration::try_from_secs_f64(self.wait).context("--wait is no number of seconds")
    }

    /// By what frames are read where no hub says what it found.
    pub(super) fn settings(&self) -> anyhow::Result<HubSettings> {
        let Some(path) = &self.config else { return Ok(HubSettings::default()) };
        settings_of_file(path)
    }
}
