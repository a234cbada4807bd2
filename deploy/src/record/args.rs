//! The command line of the recorder.

use anyhow::Context;
use std::collections::BTreeMap;
use std::path::PathBuf;
use v2x_common::clock;
use v2x_common::duration::{parse_rotation, parse_seconds};
use v2x_common::id::{HubId, NetworkId};
use v2x_common::net::endpoint_given::to_connect;
use v2x_common::net::session::SessionOptions;
use v2x_common::recording::RecordingOptions;
use v2x_common::time::Span;
use v2x_common::version;

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x record run.mcap                  until Ctrl-C: frames, lists, truth, and
                                       the journals of the hubs
  v2x record run.mcap --count 1000     until a thousand lists have come
  v2x record run.mcap --duration 30s   for half a minute
  v2x record run.mcap --rotate-mb 500  run.mcap, run-2.mcap, …: each can be used
                                       by itself; where they are there,
                                       with the next number
  v2x record run.mcap --hub north      lists and journal of that hub alone
  v2x replay run.mcap                  puts it on a network again
  lab retrack run.mcap                 computes the hub again, and compares bit
                                       by bit
Foxglove and Lichtblick show such a file as it is: add the topics that end with
/scene to a 3D panel.")]
pub(crate) struct RecordArgs {
    /// The file to write; one that exists is refused, unless files rotate: then the next number is taken
    pub(crate) file: PathBuf,
    /// The network to record
    #[arg(long, default_value = "demo")]
    pub(crate) network: NetworkId,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    pub(crate) connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    pub(crate) zenoh_config: Option<PathBuf>,
    /// Believe and record this hub alone [default: every hub]
    #[arg(long, value_name = "NAME")]
    pub(crate) hub: Option<HubId>,
    /// End after this many fused frames
    #[arg(long, value_name = "N")]
    pub(crate) count: Option<u64>,
    /// End after so long
    #[arg(long, value_name = "DURATION", value_parser = parse_seconds)]
    pub(crate) duration: Option<f64>,
    /// How long to wait for a hub
    #[arg(long, default_value = "10s", value_name = "DURATION", value_parser = parse_seconds)]
    pub(crate) wait: f64,
    /// Overwrite the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Begin a further file (FILE-2, FILE-3, …) after so many megabytes
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) rotate_mb: Option<u64>,
    /// Begin a further file after so long, such as 90s or 2h; a plain number is minutes
    #[arg(long, value_name = "DURATION", value_parser = parse_rotation)]
    pub(crate) rotate_min: Option<f64>,
    /// Scenes a second for Foxglove's viewers of each list and agent; 0 for none
    #[arg(long, default_value_t = 5.0, value_name = "HZ")]
    pub(crate) scene_hz: f64,
    /// A file that belongs to the recording, as NAME=PATH
    #[arg(long, hide = true, value_parser = named)]
    pub(crate) attach: Vec<(String, String)>,
    /// What the recording says of itself, as KEY=VALUE
    #[arg(long, hide = true, value_parser = named)]
    pub(crate) fact: Vec<(String, String)>,
    /// Print life-cycle events as JSON lines on standard output
    #[arg(long, hide = true)]
    pub(crate) events: bool,
    /// End when standard input does (for children of a launcher)
    #[arg(long, hide = true)]
    pub(crate) exit_with_stdin: bool,
}

impl RecordArgs {
    /// How to reach the network.
    pub(crate) fn session_options(&self) -> SessionOptions {
        SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: Vec::new(),
        }
    }

    /// How the file is written.
    ///
    /// # Errors
    /// Where what belongs to it cannot be read.
    pub(crate) fn options(&self) -> anyhow::Result<RecordingOptions> {
        let is_wanted = self.scene_hz.is_finite() && self.scene_hz > 0.0;
        let mut facts = facts(self.network);
        facts.extend(self.fact.iter().cloned());
        let mut attachments = BTreeMap::new();
        for (name, path) in &self.attach {
            let data = std::fs::read(path).with_context(|| format!("reading {path}"))?;
            attachments.insert(name.clone(), data);
        }
        Ok(RecordingOptions {
            overwrite: self.force,
            rotate_bytes: self.rotate_mb.map(|megabytes| megabytes.saturating_mul(1_000_000)),
            rotate_after: self.rotate_min.map(|minutes| Span::from_secs_f64(60.0 * minutes)),
            scene_interval: is_wanted.then(|| Span::from_secs_f64(1.0 / self.scene_hz)),
            facts,
            attachments,
        })
    }
}

/// A pair `NAME=VALUE`.
fn named(text: &str) -> Result<(String, String), String> {
    let pair = text.split_once('=').ok_or("it is no NAME=VALUE")?;
    Ok((pair.0.to_owned(), pair.1.to_owned()))
}

/// What a recording says of itself.
fn facts(network: NetworkId) -> BTreeMap<String, String> {
    let facts = [
        ("version", version::VERSION.to_owned()),
        ("commit", version::COMMIT.to_owned()),
        ("network", network.to_string()),
        ("recorded_by", "v2x record".to_owned()),
        ("recorded_at_us", clock::now().as_micros().to_string()),
    ];
    facts.map(|(key, value)| (key.to_owned(), value)).into()
}
