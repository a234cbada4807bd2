//! `lab rerun`: puts the recorded frames of a run through another method or other settings, and scores that.

use crate::commands::run_folder::{RunFolder, print_summary};
use anyhow::{Context, bail};
use std::path::PathBuf;
use v2x_fusion_hub::fusion::{PRESETS, preset};
use v2x_fusion_hub::hub::{HubSettings, hub_table};

/// Put the recorded frames of a run through another method or other settings, and score that
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab rerun v2x-runs/2026-11-28_14-05-31-crossing --method csba-wls
  lab rerun v2x-runs/2026-11-28_14-05-31-crossing --config other.toml    with its [hub] table
The folder stays as it is. Latency within the hub is not measured: nothing runs live.")]
pub struct RerunArgs {
    /// The folder of a run that v2x demo recorded
    folder: PathBuf,
    /// The method, by its key in deploy/docs/methods.md
    #[arg(long, value_name = "KEY")]
    method: Option<String>,
    /// A TOML file whose [hub] table holds the settings [default: those of the run]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the summary as one line of JSON
    #[arg(long)]
    json: bool,
}

/// Runs and scores.
///
/// # Errors
/// Where the run cannot be read, or the method is not known.
pub fn rerun(args: &RerunArgs) -> anyhow::Result<()> {
    let folder = RunFolder::open(&args.folder)?;
    let mut settings = match &args.config {
        Some(path) => {
            HubSettings::from_table(hub_table(path)?).with_context(|| format!("in {}", path.display()))?
        }
        None => folder.settings()?,
    };
    if let Some(key) = &args.method {
        let Some(preset) = preset(key) else {
            let known = PRESETS.iter().map(|preset| preset.key).collect::<Vec<_>>().join(", ");
            bail!("--method {key}: there is none of this name; there are {known}");
        };
        settings.engine = settings.engine.with_preset(preset);
    }
    print_summary(&folder.rescored_with(settings)?, args.json)
}
