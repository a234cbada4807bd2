//! The command line of `v2x runs`.

use std::path::PathBuf;
use std::time::Duration;
use v2x_common::duration::parse_seconds;
use v2x_lab::commands::RUNS;

/// List the folders of runs, the newest first, or delete old ones
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x runs                            each run with its verdict, size and age
  v2x runs --json | jq '.[] | select(.passed == false) | .path'
  v2x runs prune --keep 10            asks, then deletes all but the newest ten
  v2x runs prune --older-than 7d --dry-run
  v2x runs prune --keep 0 --yes       all of them, without a question")]
#[command(args_conflicts_with_subcommands = false)]
pub(crate) struct RunsArgs {
    #[command(subcommand)]
    pub(super) command: Option<RunsCommand>,
    /// The folder of the runs
    #[arg(long, value_name = "FOLDER", default_value = RUNS, global = true)]
    pub(super) folder: PathBuf,
    /// Print the list as one line of JSON
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Debug, clap::Subcommand)]
pub(super) enum RunsCommand {
    /// Delete old runs; asks first
    Prune(PruneArgs),
}

#[derive(Clone, Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("which").required(true).multiple(true)), after_help = "\
Only folders that a run made are deleted, and none of a run that goes on. With
both --keep and --older-than, runs that both select are deleted.

Examples:
  v2x runs prune --keep 10
  v2x runs prune --older-than 7d --yes")]
pub(super) struct PruneArgs {
    /// Keep the newest N runs
    #[arg(long, value_name = "N", group = "which")]
    pub(super) keep: Option<usize>,
    /// Delete runs that are older than this, such as 12h, 7d or 4w
    #[arg(long, value_name = "AGE", value_parser = parse_age, group = "which")]
    pub(super) older_than: Option<Duration>,
    /// Delete without a question
    #[arg(long)]
    pub(super) yes: bool,
    /// Only print what would be deleted
    #[arg(long, conflicts_with = "yes")]
    pub(super) dry_run: bool,
}

/// An age such as `30min`, `12h`, `7d` or `4w`; with its unit, because what is deleted does not come back.
fn parse_age(text: &str) -> Result<Duration, String> {
    let wrong = || "write an age such as 30min, 12h, 7d or 4w, with its unit".to_owned();
    if !text.ends_with(|c: char| c.is_ascii_alphabetic()) {
        return Err(wrong());
    }
    let seconds = parse_seconds(text).map_err(|_| wrong())?;
    Duration::try_from_secs_f64(seconds).map_err(|_| wrong())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_need_a_number_and_a_unit() {
        assert_eq!(parse_age("7d"), Ok(Duration::from_secs(604_800)));
        for (text, seconds) in [("30min", 1800), ("12s", 12), ("1.5h", 5400), ("4w", 2_419_200)] {
            assert_eq!(parse_age(text), Ok(Duration::from_secs(seconds)), "{text}");
        }
        for bad in ["7", "d", "", "-1d", "7 days", "99999999999999999999w", "1e300d"] {
            assert!(parse_age(bad).is_err(), "{bad}");
        }
    }
}
