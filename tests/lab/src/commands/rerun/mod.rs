//! `lab rerun`: puts recorded frames through another method or other settings. Where the truth is known, that is scored.

mod lists;

use self::lists::Counts;
use crate::commands::recorded_run::RecordedRun;
use crate::commands::run_folder::{RunFolder, print_summary};
use crate::commands::run_parts::no_run;
use crate::data::hub_inputs::hub_inputs;
use crate::data::recorded_lists::recorded_lists;
use crate::drive::rerun::rerun as run_again;
use crate::report::output::print;
use anyhow::{Context, bail, ensure};
use std::path::{Path, PathBuf};
use v2x_common::recording::Recording;
use v2x_fusion_hub::fusion::{PRESETS, preset};
use v2x_fusion_hub::hub::{HubSettings, settings_of_file};

/// Put the frames of a recording or a run through another method or other settings; score it where the truth is known
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab rerun v2x-runs/2026-11-28_14-05-31-crossing --method csba-wls
  lab rerun v2x-runs/2026-11-28_14-05-31-crossing --config other.toml
        with its [hub] table
  lab rerun run.mcap --method nms --lists nms.jsonl
        of any recording; what the hub publishes then
The folder of a run has its truth, and so has a recording of v2x up --record:
there the score is printed. Of another recording the numbers of lists, objects
and frames are printed, beside those of the recorded hub. What was recorded
stays as it is. Latency within the hub is not measured: nothing runs live.")]
pub struct RerunArgs {
    /// The folder of a run that v2x demo recorded, or any recording
    #[arg(value_name = "FOLDER|FILE")]
    path: PathBuf,
    /// The method, by its key in deploy/docs/methods.md
    #[arg(long, value_name = "KEY")]
    method: Option<String>,
    /// A TOML file whose [hub] table holds the settings [default: those of the recorded hub]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Write what the hub publishes into this file, a list a line, as v2x watch --json prints them
    #[arg(long, value_name = "FILE")]
    lists: Option<PathBuf>,
    /// Print the summary as one line of JSON
    #[arg(long)]
    json: bool,
}

/// Runs, and scores where it can.
///
/// # Errors
/// Where the recording cannot be read, or the method is not known.
pub fn rerun(args: &RerunArgs) -> anyhow::Result<()> {
    if !RunFolder::is_run(&args.path) {
        if !args.path.is_file() {
            return Err(no_run(&args.path));
        }
        let Some(run) = RecordedRun::unpack(&args.path)? else { return of_recording(args, &args.path) };
        return of_run(args, run.folder()).or_else(|error| {
            tracing::warn!("the recording has a scenario and cannot be scored by it: {error:#}");
            of_recording(args, &args.path)
        });
    }
    of_run(args, &RunFolder::open(&args.path)?)
}

/// Of a run, with its truth.
fn of_run(args: &RerunArgs, folder: &RunFolder) -> anyhow::Result<()> {
    let (summary, published) = folder.rescored_with(settings(args, || folder.settings())?)?;
    if let Some(lists) = &args.lists {
        lists::write(&published, lists)?;
    }
    print_summary(&summary, args.json)
}

/// Of a recording without truth: how many lists, objects and frames there are now, and were then.
fn of_recording(args: &RerunArgs, path: &Path) -> anyhow::Result<()> {
    let given = hub_inputs(open(path)?).with_context(|| format!("in {}", path.display()))?;
    ensure!(!given.inputs.is_empty(), "{} holds no frames", path.display());
    if given.settings.is_none() && args.config.is_none() {
        tracing::warn!("the recording has no journal, and so no settings of its hub: the defaults are used");
    }
    let settings = settings(args, || Ok(given.settings.clone().unwrap_or_default()))?;
    let published = run_again(&given, settings).context("running the hub again")?.lists;
    if let Some(out) = &args.lists {
        lists::write(&published, out)?;
    }
    let now = Counts::of(&published);
    let then = recorded_lists(open(path)?).with_context(|| format!("in {}", path.display()))?;
    let then = Counts::of(&then.lists);
    print(&lists::text(&now, &then, args.json)?).context("writing the numbers")
}

fn open(path: &Path) -> anyhow::Result<Recording<std::io::BufReader<std::fs::File>>> {
    Recording::open(path).with_context(|| format!("opening {}", path.display()))
}

/// The settings that the options ask for.
fn settings(
    args: &RerunArgs,
    recorded: impl FnOnce() -> anyhow::Result<HubSettings>,
) -> anyhow::Result<HubSettings> {
    let mut settings = match &args.config {
        Some(path) => settings_of_file(path)?,
        None => recorded()?,
    };
    if let Some(key) = &args.method {
        let Some(preset) = preset(key) else {
            let known = PRESETS.iter().map(|preset| preset.key).collect::<Vec<_>>().join(", ");
            bail!("--method {key}: there is none of this name; there are {known}");
        };
        settings.engine = settings.engine.with_preset(preset);
    }
    Ok(settings)
}
