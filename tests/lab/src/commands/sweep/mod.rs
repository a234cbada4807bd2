//! `lab sweep`: error and timing against any parameter of a scenario, for several ways to deal with delays.
//!
//! What is varied and compared is in [`crate::drive::sweep`]; a run is scored into a
//! [`record`](crate::score::sweep::record). Records are kept, so that a sweep that was stopped goes on where it was.

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

/// Runs a sweep, or what is left of it, and writes and prints what came of it.
#[expect(clippy::print_stderr, reason = "what people read while the JSON goes elsewhere")]
pub async fn sweep(args: &SweepArgs) -> anyhow::Result<ExitCode> {
    let plan = args.plan()?;
    let folder = args.folder();
    // Before anything is written.
    plan.points()?;
    let store = Store::open(&folder)?;
    if !store.is_empty() {
        let (folder, n) = (folder.display(), store.len());
        eprintln!(
            "{folder} holds {n} runs: what is of this sweep is not run again, and the report is made anew"
        );
    }
    let threads = args.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let simulated = Plan { live: false, ..plan.clone() };
    let mut results = vec![run_virtual(&simulated, &store, threads)?];
    if plan.live {
        // A network has processes to be ended; what is computed here, Ctrl-C may end on the spot.
        let shutdown = shutdown::token(false)?;
        let Some(live) = run_live(&plan, (&store, &folder), &shutdown).await? else {
            eprintln!("interrupted; all processes have ended, and the same command goes on from here");
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

/// The command line that asked for it, for the report.
fn command() -> String {
    let words = std::env::args().skip(1);
    std::iter::once("lab".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
