//! `lab report`: one page of a recorded run, or of any recording.

use crate::commands::recorded_run::RecordedRun;
use crate::commands::report_of_recording::page_of;
use crate::commands::run_folder::RunFolder;
use crate::report::output::print;
use anyhow::{Context, ensure};
use std::path::{Path, PathBuf};

/// Write one page of a recording: verdict, errors over time, latencies, agents, key frames
///
/// A run has ground truth: it is scored, and the page begins with the verdict; so
/// is a recording of `v2x up --record`. Of any other recording the page begins with what looks wrong, in the sentences of
/// v2x check. The page holds everything that it shows: it can be sent, printed, and
/// opened without a network.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab report v2x-runs/2026-11-28_14-05-31-crossing
  lab report v2x-runs/2026-11-28_14-05-31-crossing --out crossing.html
  lab report corner.mcap
        of v2x record or v2x hub --record: writes corner.html")]
pub struct ReportArgs {
    /// The folder of a run, the recording in it, or any recording
    #[arg(value_name = "FOLDER|FILE")]
    path: PathBuf,
    /// Where the page is written [default: report.html in the folder of a run, else beside the recording with its name]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Scores and writes.
///
/// # Errors
/// Where the recording cannot be read, or the page cannot be written.
pub fn report(args: &ReportArgs) -> anyhow::Result<()> {
    let page = if RunFolder::is_run(&args.path) || !args.path.is_file() {
        of_run(&args.path, args.out.as_deref())?
    } else {
        let out = args.out.clone().unwrap_or_else(|| args.path.with_extension("html"));
        ensure!(out != args.path, "--out {} is the recording itself", out.display());
        let html = scored_page(&args.path)?.map_or_else(|| page_of(&args.path), Ok)?;
        std::fs::write(&out, html).with_context(|| format!("writing {}", out.display()))?;
        out
    };
    print(&format!("{}\n", page.display())).context("writing the page's path")
}

/// Of a recording that holds its scenario, with its truth; `None` of any other one.
fn scored_page(recording: &Path) -> anyhow::Result<Option<String>> {
    let Some(run) = RecordedRun::unpack(recording)? else { return Ok(None) };
    if let Err(error) = run.folder().score() {
        tracing::warn!("the recording has a scenario and cannot be scored by it: {error:#}");
        return Ok(None);
    }
    let page = run.folder().path().join("report.html");
    std::fs::read_to_string(&page).map(Some).with_context(|| format!("reading {}", page.display()))
}

/// Of a run, with its truth.
fn of_run(path: &Path, out: Option<&Path>) -> anyhow::Result<PathBuf> {
    let folder = RunFolder::open(path)?;
    folder.score()?;
    let page = folder.path().join("report.html");
    let Some(out) = out else { return Ok(page) };
    std::fs::copy(&page, out).with_context(|| format!("writing {}", out.display()))?;
    Ok(out.to_owned())
}
