//! `lab retrack`: computes a recorded hub again, and compares what it published bit by bit.

use crate::drive::retrack::{Journalled, Retracker};
use crate::report::output::print;
use anyhow::{Context, bail};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use v2x_common::id::HubId;
use v2x_common::recording::{Recording, RecordingError};

/// What to do about a recording that cannot be computed again.
const RECORD_SO: &str = "record with `v2x record`, `v2x demo` or `v2x hub --record` of this version";

/// Compute a recorded hub again from its journal, and compare what it published bit by bit
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x record run.mcap   records a network with the journals of its hubs
  lab retrack run.mcap  identical (N lists): exit code 0
  lab retrack v2x-runs/*-crossing/recording.mcap
The exit code is 1 where a list differs; where nothing can be compared, it says
why.")]
pub struct RetrackArgs {
    /// A recording; of a rotated one each file by itself
    recording: PathBuf,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

/// Computes and compares.
///
/// # Errors
/// Where the recording cannot be read, or holds nothing that can be compared.
pub fn retrack(args: &RetrackArgs) -> anyhow::Result<ExitCode> {
    let path = args.recording.display();
    let recording = Recording::open(&args.recording).with_context(|| format!("opening {path}"))?;
    // A broken state of a hub is found where it is used: that must not end this program without a word.
    let found = std::thread::spawn(move || hubs_of(recording)).join();
    let Ok(found) = found else { bail!("{path}: the saved state of the hub contradicts itself") };
    let found = found.with_context(|| format!("in {path}"))?;
    check(&found).with_context(|| format!("nothing to compare in {path}"))?;
    let is_identical = found.values().all(|hub| hub.different.is_none());
    let text = if args.json { to_json(&found).to_string() + "\n" } else { to_text(&found) };
    print(&text)?;
    Ok(if is_identical { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn hubs_of(
    recording: impl Iterator<Item = Result<v2x_common::recording::Entry, RecordingError>>,
) -> anyhow::Result<BTreeMap<HubId, Journalled>> {
    let mut retracker = Retracker::default();
    for entry in recording {
        match entry {
            Ok(entry) => retracker.handle(&entry).with_context(|| format!("payload of {}", entry.key))?,
            Err(unfinished @ RecordingError::Unfinished { .. }) => {
                tracing::warn!("{unfinished}; what it holds is compared");
                break;
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(retracker.end())
}

/// Whether there is anything to compare, and if not, why.
fn check(found: &BTreeMap<HubId, Journalled>) -> anyhow::Result<()> {
    if found.is_empty() {
        bail!("it holds no lists and no journal: {RECORD_SO}");
    }
    if found.values().any(|hub| hub.identical > 0 || hub.different.is_some()) {
        return Ok(());
    }
    for (hub, journalled) in found {
        if let Some(why) = &journalled.unusable {
            let (version, commit) = journalled.build.clone().unwrap_or_default();
            bail!("hub {hub} (version {version} {commit}) cannot be computed again: {why}");
        }
        if journalled.calls > 0 {
            bail!(
                "the journal of hub {hub} leads to {} lists, but none is recorded",
                journalled.not_recorded
            );
        }
        if journalled.has_journal {
            bail!(
                "the journal of hub {hub} has no start here: of a rotated recording take a file that is larger than the \
                 state of the hub (--rotate-mb)"
            );
        }
    }
    bail!("it holds no journal of a hub: {RECORD_SO}")
}

fn to_text(found: &BTreeMap<HubId, Journalled>) -> String {
    let mut text = String::new();
    for (hub, journalled) in found {
        let Journalled { identical, different, not_recorded, not_journalled, calls, gaps, .. } = journalled;
        let _ = match different {
            None if *gaps > 0 => {
                let all = identical + not_journalled;
                writeln!(text, "hub {hub}: identical in {identical} of {all} lists; the journal has gaps")
            }
            None => writeln!(text, "hub {hub}: identical ({identical} lists, {calls} calls of the core)"),
            Some(difference) => {
                writeln!(text, "hub {hub}: DIFFERENT: {difference} ({identical} lists are identical)")
            }
        };
        for (count, what) in [
            (not_journalled, "recorded lists are from before the journal or within a gap of it"),
            (not_recorded, "computed lists were not recorded"),
            (gaps, "gaps in the journal"),
        ] {
            if *count > 0 {
                let _ = writeln!(text, "  {count} {what}");
            }
        }
    }
    text
}

fn to_json(found: &BTreeMap<HubId, Journalled>) -> Value {
    let hubs = found.iter().map(|(hub, journalled)| {
        let Journalled { identical, different, not_recorded, not_journalled, calls, gaps, build, .. } =
            journalled;
        json!({
            "hub": hub,
            "identical": identical,
            "first_difference": different.as_ref().map(ToString::to_string),
            "not_recorded": not_recorded,
            "not_journalled": not_journalled,
            "calls": calls,
            "gaps": gaps,
            "build": build,
        })
    });
    json!({ "hubs": hubs.collect::<Vec<_>>() })
}
