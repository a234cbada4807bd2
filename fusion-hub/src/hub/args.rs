//! The hub's command line.

use crate::hub::settings::HubSettings;
use anyhow::Context;
use std::path::{Path, PathBuf};
use v2x_common::id::{HubId, NetworkId};
use v2x_common::net::session::SessionOptions;

/// Fuse the detections of all agents into one list of objects, and publish it.
///
/// The hub is a Zenoh router: agents and consumers connect to it, and nothing else needs to run.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x hub                                        listen on tcp/127.0.0.1:7447, this machine only
  v2x hub --listen tcp/0.0.0.0:7447              for agents on the network
  v2x hub --config crossing.toml                 with the [hub] table of a scenario
  v2x hub --zenoh-config my-hub.json5            with Zenoh's own settings (this build has only its TCP transport)
The program fusion-hub is the same hub alone.")]
pub struct HubArgs {
    /// The network to serve; hubs and agents of other networks are ignored
    #[arg(long, default_value = "demo")]
    pub network: NetworkId,
    /// The hub's name in keys and frames [default: the settings' id, or `hub`]
    #[arg(long)]
    pub id: Option<HubId>,
    /// A TOML file whose `[hub]` table holds the settings (a scenario file is one)
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Endpoint to listen on; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT")]
    pub listen: Vec<String>,
    /// A further Zenoh router to join; may be given more than once
    #[arg(long, value_name = "ENDPOINT")]
    pub connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    pub zenoh_config: Option<PathBuf>,
    /// Print life-cycle events as JSON lines on standard output
    #[arg(long, hide = true)]
    pub events: bool,
    /// End when standard input does (for children of a launcher)
    #[arg(long, hide = true)]
    pub exit_with_stdin: bool,
}

impl HubArgs {
    /// The settings, from the file and the command line.
    pub fn settings(&self) -> anyhow::Result<HubSettings> {
        let mut settings = match &self.config {
            Some(path) => load(path)?,
            None => HubSettings::default(),
        };
        if let Some(id) = self.id {
            settings.engine.hub = id;
        }
        Ok(settings)
    }

    /// The session options of the command line.
    pub fn session_options(&self) -> SessionOptions {
        SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: self.listen.clone(),
        }
    }
}

fn load(path: &Path) -> anyhow::Result<HubSettings> {
    HubSettings::from_table(hub_table(path)?).with_context(|| format!("in {}", path.display()))
}

/// The `[hub]` table of a settings or scenario file, unchecked; an empty one where it has none.
pub fn hub_table(path: &Path) -> anyhow::Result<toml::Table> {
    let text = std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
    let mut file: toml::Table = text.parse().with_context(|| format!("in {}", path.display()))?;
    match file.remove("hub") {
        Some(toml::Value::Table(table)) => Ok(table),
        Some(_) => anyhow::bail!("in {}: hub is no table", path.display()),
        None => Ok(toml::Table::new()),
    }
}
