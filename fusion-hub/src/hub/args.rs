//! The hub's command line.

use crate::hub::monitoring::metrics;
use crate::hub::settings::HubSettings;
use anyhow::Context;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use v2x_common::duration::parse_rotation;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::net::endpoint_given::{to_connect, to_listen};
use v2x_common::net::session::SessionOptions;
use v2x_common::recording::RecordingOptions;
use v2x_common::time::Span;
use v2x_common::version;

/// The table of a file that is the hub's.
const HUB: &str = "hub";

/// Fuse the detections of all agents into one list of objects, and publish it.
///
/// The hub is a Zenoh router: agents and consumers connect to it, and nothing else needs to run.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x hub                            listen on tcp/127.0.0.1:7447, this machine
                                     only
  v2x hub --listen tcp/0.0.0.0:7447  for everybody on the network, who can
                                     publish as anybody
  v2x hub --zenoh-config certs/hub/hub/zenoh.json5
                                     for those with a certificate (v2x certs)
  v2x hub --standby --connect tcp/192.168.1.10:7447
                                     publishes when the hub there does not
  v2x hub --config crossing     with the [hub] table of a scenario
  v2x hub --metrics                  with metrics and health at
                                     http://127.0.0.1:9464/metrics
  v2x hub --record run.mcap --rotate-mb 500
                                     with a recording that `lab retrack`
                                     computes again; started again, it goes on
                                     with the next number
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
    #[arg(long, value_name = "ENDPOINT", value_parser = to_listen)]
    pub listen: Vec<String>,
    /// A further Zenoh router to join; may be given more than once
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    pub connect: Vec<String>,
    /// Publish only while no other hub of this name does, under the ids that it gave; both are to have this option
    #[arg(long)]
    pub standby: bool,
    /// A Zenoh configuration file that replaces our defaults; it is followed when written anew
    #[arg(long, value_name = "FILE")]
    pub zenoh_config: Option<PathBuf>,
    /// Record all that arrives and is published, and the journal, into an MCAP file; one that exists is refused, unless files
    /// rotate: then the next number is taken
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Begin a further file (FILE-2, FILE-3, …) after so many megabytes
    #[arg(long, value_name = "MB", requires = "record", value_parser = clap::value_parser!(u64).range(1..))]
    pub rotate_mb: Option<u64>,
    /// Begin a further file after so long, such as 90s or 2h; a plain number is minutes
    #[arg(long, value_name = "DURATION", requires = "record", value_parser = parse_rotation)]
    pub rotate_min: Option<f64>,
    /// Overwrite the recording if there is one of this name
    #[arg(long, requires = "record")]
    pub force: bool,
    /// Serve metrics for Prometheus, /healthz, /readyz and /livez at this address [default: 127.0.0.1:9464]
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = metrics::DEFAULT,
          value_parser = metrics::parse)]
    pub metrics: Option<SocketAddr>,
    /// A file that is there while the hub is ready, with its endpoints as JSON
    #[arg(long, value_name = "FILE")]
    pub ready_file: Option<PathBuf>,
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
            Some(path) => settings_of_file(path)?,
            None => HubSettings::default(),
        };
        if let Some(id) = self.id {
            settings.engine.hub = id;
        }
        settings.standby |= self.standby;
        Ok(settings)
    }

    /// A recording that another start of the program would overwrite, or end at.
    pub(super) fn recording_that_is_in_the_way(&self) -> Option<PathBuf> {
        let takes_next_number = (self.rotate_mb.is_some() || self.rotate_min.is_some()) && !self.force;
        self.record.clone().filter(|_| !takes_next_number)
    }

    /// The recording, if any: its file and how it is written.
    pub fn recording(&self) -> Option<(PathBuf, RecordingOptions)> {
        let path = self.record.clone()?;
        let facts = [
            ("version", version::VERSION.to_owned()),
            ("commit", version::COMMIT.to_owned()),
            ("network", self.network.to_string()),
            ("recorded_by", "hub".to_owned()),
        ];
        let options = RecordingOptions {
            overwrite: self.force,
            rotate_bytes: self.rotate_mb.map(|megabytes| megabytes.saturating_mul(1_000_000)),
            rotate_after: self.rotate_min.map(|minutes| Span::from_secs_f64(60.0 * minutes)),
            facts: facts.map(|(key, value)| (key.to_owned(), value)).into(),
            ..RecordingOptions::default()
        };
        Some((path, options))
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

/// The settings of a hub by the `[hub]` table of a file, or of a shipped scenario by its name; of a file without one, the
/// defaults, and that is said.
pub fn settings_of_file(path: &Path) -> anyhow::Result<HubSettings> {
    HubSettings::from_table(hub_table(path)?).with_context(|| format!("in {}", path.display()))
}

/// The `[hub]` table of a settings or scenario file, or of a shipped scenario by its name, unchecked; an empty one where it has none,
/// and that is said.
pub fn hub_table(path: &Path) -> anyhow::Result<toml::Table> {
    let table = hub_table_if_any(path)?;
    if table.is_none() {
        tracing::warn!("{} has no [hub] table: the hub's defaults are used", path.display());
    }
    Ok(table.unwrap_or_default())
}

/// The same, without a word; `None` where the file has none.
pub fn hub_table_if_any(path: &Path) -> anyhow::Result<Option<toml::Table>> {
    let is_name = path.extension().is_none();
    if !is_name && !path.exists() {
        anyhow::bail!(
            "no configuration file {}: give a TOML file with a [hub] table, or the name of a shipped scenario",
            path.display()
        );
    }
    let text = v2x_common::shipped::read(path).with_context(|| format!("reading {}", path.display()))?;
    let mut file: toml::Table = text.parse().with_context(|| format!("in {}", path.display()))?;
    check_tables(&file).with_context(|| format!("in {}", path.display()))?;
    match file.remove(HUB) {
        Some(toml::Value::Table(table)) => Ok(Some(table)),
        Some(_) => anyhow::bail!("in {}: hub is no table", path.display()),
        None => Ok(None),
    }
}

/// Refuses what is meant for the hub and would be ignored. Other tables are those of a scenario, or of other programs.
fn check_tables(file: &toml::Table) -> anyhow::Result<()> {
    let is_hub = |key: &str| key.trim().eq_ignore_ascii_case(HUB);
    if let Some(key) = file.keys().find(|key| *key != HUB && is_hub(key)) {
        anyhow::bail!("unknown table [{key}] (did you mean `[hub]`?)");
    }
    // The agents of a scenario are a list: `[[agents]]`.
    let agent = ["agents", "agent"].into_iter().find_map(|key| {
        let (agent, _) = file.get(key)?.as_table()?.iter().find(|(_, value)| value.is_table())?;
        Some((key, agent))
    });
    if let Some((key, agent)) = agent {
        anyhow::bail!("unknown table [{key}.{agent}] (did you mean `[hub.agents.{agent}]`?)");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_is_meant_for_the_hub_is_no_table_of_another_program() {
        let check = |text: &str| check_tables(&text.parse().expect("valid TOML"));
        for (text, named) in [
            ("[Hub]\nid = \"a\"", "[Hub] (did you mean `[hub]`?)"),
            ("[hub]\n[HUB.agents.cam1]", "[HUB] (did you mean `[hub]`?)"),
            ("[hub]\n[agents.cam1]\nsizes = \"w-along\"", "did you mean `[hub.agents.cam1]`?"),
            ("[agent.cam1]", "did you mean `[hub.agents.cam1]`?"),
        ] {
            let message = check(text).expect_err(text).to_string();
            assert!(message.contains(named), "{message:?} should name {named:?}");
        }
        for text in [
            "",
            "[hub]\n[hub.agents.cam1]",
            "[[agents]]\nid = \"cam1\"\n[hub]\n[pub]\nx = 1",
            "[agents]\nn = 3",
        ] {
            check(text).expect(text);
        }
    }
}
