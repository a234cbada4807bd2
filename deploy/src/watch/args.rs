//! The consumer's command line.

use super::objects::SortKey;
use crate::foxglove::FoxgloveArgs;
use crate::record::RecordArgs;
use crate::web::WebArgs;
use std::path::PathBuf;
use v2x_common::duration::parse_seconds;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::net::endpoint_given::to_connect;
use v2x_common::net::session::SessionOptions;
use v2x_common::tile::Tile;
use v2x_lab::loopback::consumer::Traffic;

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x watch                            a live table of a network on this machine
  v2x watch --connect tcp/192.168.1.10:7447
                                       of a hub elsewhere
  v2x watch --hub north                that hub alone, whoever else publishes
                                       lists
  v2x watch --sort speed               the fastest objects first; the key s
                                       changes it
  v2x watch --json --count 100         the next hundred fused frames as JSON
                                       lines
  v2x watch --lagged                   the second list, a lag behind, where the
                                       hub has one
  v2x watch --delta                    the list by what changes: a tenth of the
                                       bytes, within 0.2 m
  v2x watch --tile 120230002213        the objects of a tile and its parts,
                                       where the hub has `tiles`
  v2x watch --web                      in your browser, at
                                       http://127.0.0.1:8088/
  v2x watch --web --scenario crossing  with the roads and the truth of a
                                       simulation by `v2x up crossing`
  v2x watch --foxglove                 in Foxglove or Lichtblick, at
                                       ws://127.0.0.1:8765
  v2x watch --record run.mcap          records it, as `v2x record` does

In a terminal the table fits the window. Its keys: q, Esc or Ctrl-C end; s sorts
by the next column, r the other way round; ↑ ↓ PgUp PgDn Home End scroll; p
pauses; Tab shows the next hub. NO_COLOR=1 leaves out colours. Into a pipe, or
with TERM=dumb, the table is printed as plain lines once a second.")]
pub(crate) struct WatchArgs {
    /// The network to watch
    #[arg(long, default_value = "demo")]
    pub(crate) network: NetworkId,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    pub(crate) connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    pub(crate) zenoh_config: Option<PathBuf>,
    /// Believe this hub alone [default: every hub]
    #[arg(long, value_name = "NAME")]
    pub(crate) hub: Option<HubId>,
    /// Watch the second list, which is a lag behind, of a hub with the setting `lagged`
    #[arg(long, conflicts_with = "record")]
    pub(crate) lagged: bool,
    /// Follow the list by what changes in it
    #[arg(long, conflicts_with = "lagged")]
    pub(crate) delta: bool,
    /// Watch the objects of a tile and its parts, by the digits of its quadkey, of a hub with the setting `tiles`
    #[arg(long, value_name = "DIGITS", conflicts_with_all = ["lagged", "delta"])]
    pub(crate) tile: Option<Tile>,
    /// What the table is sorted by
    #[arg(long, value_enum, default_value_t, value_name = "COLUMN", conflicts_with_all = ["json", "record"])]
    pub(crate) sort: SortKey,
    /// Print every fused frame as one line of JSON
    #[arg(long, conflicts_with_all = ["record", "web"])]
    pub(crate) json: bool,
    /// Record everything on the network into a file; with --delta or --tile that alone
    #[arg(long, value_name = "FILE", conflicts_with = "web")]
    pub(crate) record: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) web: WebArgs,
    #[command(flatten)]
    pub(crate) foxglove: FoxgloveArgs,
    /// With --web: the scenario that is simulated, for its roads and its truth; a file or a shipped scenario's name
    #[arg(long, value_name = "FILE|NAME", requires = "web")]
    pub(crate) scenario: Option<String>,
    /// With --scenario: the seed of the simulation [default: the scenario's]
    #[arg(long, value_parser = v2x_common::seed::parse_seed, requires = "scenario")]
    pub(crate) seed: Option<u64>,
    /// End after this many fused frames
    #[arg(long, value_name = "N")]
    pub(crate) count: Option<u64>,
    /// How long to wait for a hub
    #[arg(long, default_value = "10s", value_name = "DURATION", value_parser = parse_seconds)]
    pub(crate) wait: f64,
    /// Print life-cycle events as JSON lines on standard output
    #[arg(long, hide = true, conflicts_with = "json")]
    pub(crate) events: bool,
    /// End when standard input does (for children of a launcher)
    #[arg(long, hide = true)]
    pub(crate) exit_with_stdin: bool,
}

impl WatchArgs {
    /// What to subscribe to.
    pub(crate) const fn traffic(&self) -> Traffic {
        match (self.tile, &self.record) {
            (Some(tile), _) => Traffic::Area(tile),
            (None, _) if self.delta => Traffic::Delta,
            (None, Some(_)) => Traffic::Recording,
            (None, None) if self.lagged => Traffic::Lagged,
            (None, None) => Traffic::Fused,
        }
    }

    /// The recording that is asked for, if any.
    pub(crate) fn recording(&self) -> Option<RecordArgs> {
        Some(RecordArgs {
            file: self.record.clone()?,
            network: self.network,
            connect: self.connect.clone(),
            zenoh_config: self.zenoh_config.clone(),
            hub: self.hub,
            duration: None,
            count: self.count,
            wait: self.wait,
            force: false,
            rotate_mb: None,
            rotate_min: None,
            scene_hz: 0.0,
            attach: Vec::new(),
            fact: Vec::new(),
            events: self.events,
            exit_with_stdin: self.exit_with_stdin,
        })
    }

    /// How to reach the network.
    pub(crate) fn session_options(&self) -> SessionOptions {
        SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: Vec::new(),
        }
    }
}
