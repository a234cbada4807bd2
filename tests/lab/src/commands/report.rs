//! `lab report`: one page of a recorded run.

use crate::commands::run_folder::RunFolder;
use crate::report::output::print;
use anyhow::Context;
use std::path::PathBuf;

/// Score a recorded run and write its page: verdict, errors over time, latencies, agents, key frames
///
/// The page holds everything that it shows: it can be sent, printed, and opened without a network.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  lab report v2x-runs/2026-11-28_14-05-31-crossing
  lab report v2x-runs/2026-11-28_14-05-31-crossing --out crossing.html")]
pub struct ReportArgs {
    /// The folder of the run, or the recording in it
    #[arg(value_name = "FOLDER|FILE")]
    path: PathBuf,
    /// Where the page is written, too [default: report.html in the folder alone]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Scores and writes.
pub fn report(args: &ReportArgs) -> anyhow::Result<()> {
    let folder = RunFolder::open(&args.path)?;
    folder.score()?;
    let page = folder.path().join("report.html");
    if let Some(out) = &args.out {
        std::fs::copy(&page, out).with_context(|| format!("writing {}", out.display()))?;
    }
    print(&format!("{}\n", args.out.as_ref().unwrap_or(&page).display())).context("writing the page's path")
}
