//! The command line of `v2x scenario`.

use crate::recorded::TrafficArgs;
use std::path::PathBuf;

/// Write a commented scenario file, to begin one of your own
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ScenarioArgs {
    #[command(subcommand)]
    pub(super) action: Action,
}

#[derive(Clone, Debug, clap::Subcommand)]
pub(super) enum Action {
    /// Write a commented scenario that v2x up runs at once
    #[command(after_help = "\
Examples:
  v2x scenario init                      scenario.toml: a crossing, with a
                                         comment for each line
  v2x scenario init --world traffic.csv  traffic.toml: your recorded traffic; a
                                         car and a roadside unit
  v2x scenario init --world fcd.xml --vtypes demand.rou.xml \\
      --from 600 --to 660 rush-hour.toml
  v2x scenario init --world sumo:my.sumocfg
                                         my.toml: SUMO live; it is run to see
                                         which vehicle to ride on
Then: v2x up traffic.toml --web")]
    Init(InitArgs),
}

#[derive(Clone, Debug, clap::Args)]
pub(super) struct InitArgs {
    /// Recorded traffic (v2x world FILE shows what is in it), or sumo:CFG for a live SUMO
    #[arg(long, value_name = "FILE")]
    pub(super) world: Option<PathBuf>,
    #[command(flatten)]
    pub(super) of: TrafficArgs,
    /// The scenario file [default: scenario.toml, or the name of the recorded traffic]
    #[arg(value_name = "OUT.toml")]
    pub(super) out: Option<PathBuf>,
    /// Overwrite the file if it exists
    #[arg(long)]
    pub(super) force: bool,
}
