//! `lab sweep`: error and timing against any parameter of a scenario, for several ways to deal with delays.
//!
//! [`axis`] and [`overrides`] say what is varied, [`method`] what is compared, [`plan`] which runs that makes. A run is
//! [judged](judge) into a [`record`]; records are kept, so that a sweep that was stopped goes on where it was.

mod args;
pub mod axis;
mod figures;
mod files;
pub mod gallery;
pub mod judge;
pub mod live_point;
pub mod method;
pub mod overrides;
pub mod plan;
pub mod record;
pub mod rows;
pub mod run;
pub mod store;
mod text;
pub mod virtual_point;
pub mod ways;

pub use args::SweepArgs;

use plan::Plan;
use rows::Row;
use run::{Results, run_live, run_virtual};
use std::io::Write;
use std::process::ExitCode;
use store::Store;
use v2x_common::net::shutdown;

/// A roadside unit in time, and a car whose link is what is varied.
pub const DEFAULT_SCENARIO: &str = include_str!("../../../../deploy/scenarios/latency.toml");

/// For as many agents as one likes.
const TEN_AGENTS: &str = include_str!("../../../../deploy/scenarios/ten-agents.toml");

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
        writeln!(std::io::stdout(), "{}", serde_json::to_string(&rows)?)?;
    } else {
        writeln!(std::io::stdout(), "{text}report: {}", report.display())?;
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
