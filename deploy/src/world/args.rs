//! The command line of `v2x world`.

use crate::recorded::TrafficArgs;
use std::path::PathBuf;

/// Draw what is in a file of recorded traffic, and say what looks wrong
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Formats: CSV with columns t, id, class, x, y (optional yaw, w, d; s, m, rad),
the laboratory's CSV, INTERACTION CSV, SUMO's XML of  sumo --fcd-output fcd.xml,
CommonRoad scenarios, and the folder of nuScenes' tables. Columns yaw_deg
(counter-clockwise from east) and heading_deg (clockwise from north) are read,
too.

Examples:
  v2x world traffic.csv                  the summary, and the picture
                                         traffic.world.svg
  v2x world traffic.csv --json | jq .warnings
  v2x world fcd.xml --from 600 --to 660  one minute of a long file; only that is
                                         kept in memory
  v2x world nuscenes/v1.0-mini --scene scene-0103
  v2x world my-scenario.toml             the world of a scenario, with its roads
Then: v2x scenario init --world traffic.csv")]
pub(crate) struct WorldArgs {
    /// The file, or a scenario with recorded traffic
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) of: TrafficArgs,
    /// Where the picture is written [default: FILE.world.svg in this folder]
    #[arg(long, value_name = "FILE")]
    pub(super) svg: Option<PathBuf>,
    /// List all objects, not only those that go the longest way
    #[arg(long)]
    pub(super) all: bool,
    /// Print the summary as one line of JSON, with all objects
    #[arg(long)]
    pub(super) json: bool,
}
