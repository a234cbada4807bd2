//! `lab sweep`: error and timing against any parameter of a scenario, for several methods of handling delays.
//!
//! [`crate::drive::sweep`] holds the axes and the methods. A run is scored into a
//! [`record`](crate::score::sweep::record). Records are stored, so that a sweep that was stopped can continue.

pub(crate) mod args;
pub(crate) mod live;
pub(crate) mod run;
pub(crate) mod store;
pub(crate) mod virtual_time;

pub use args::SweepArgs;

use crate::commands::sweep::run::{run_live, run_virtual};
use crate::commands::sweep::store::Store;
use crate::drive::sweep::plan::Plan;
use crate::report::output::print;
use crate::report::sweep::results::Results;
use crate::report::sweep::rows::Row;
use crate::report::sweep::{files, text};
use std::process::ExitCode;
use v2x_common::net::shutdown;

/// The exit code of a program that Ctrl-C ended (128 + SIGINT).
const INTERRUPTED: u8 = 130;

/// Runs a sweep, or the rest of it, and writes and prints its results.
#[expect(clippy::print_stderr, reason = "what people read while the JSON goes elsewhere")]
pub async fn sweep(args: &SweepArgs) -> anyhow::Result<ExitCode> {
    let plan = args.plan()?;
    let folder = args.folder();
    // Checked before any file is written.
    plan.points()?;
    let store = Store::open(&folder)?;
    if !store.is_empty() {
        let (folder, n) = (folder.display(), store.len());
        eprintln!(
            "{folder} holds {n} runs: those of this sweep are not repeated, and the report is written again"
        );
    }
    let threads = args.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let simulated = Plan { live: false, ..plan.clone() };
    let mut results = vec![run_virtual(&simulated, &store, threads)?];
    if plan.live {
        // A live sweep has child processes to end. In virtual time, Ctrl-C can end this process immediately.
        let shutdown = shutdown::token(false)?;
        let Some(live) = run_live(&plan, (&store, &folder), &shutdown).await? else {
            eprintln!("interrupted; all processes have ended, and the same command continues the sweep");
            return Ok(ExitCode::from(INTERRUPTED));
        };
        results.push(live);
    }
    let rows: Vec<Row> = results.iter().flat_map(Results::rows).collect();
    files::write(&rows, &results, &command(), &folder)?;
    let (text, report) = (text::terminal(&rows), folder.join("report.html"));
    if args.json {
        eprintln!("{text}report: {}", report.display());
        print(&(serde_json::to_string(&rows)? + "\n"))?;
    } else {
        print(&format!("{text}report: {}\n", report.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The command line, for the report.
fn command() -> String {
    let words = std::env::args().skip(1);
    std::iter::once("lab".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
