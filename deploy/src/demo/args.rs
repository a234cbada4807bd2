//! The demo's command line.

use crate::web::WebArgs;
use std::path::PathBuf;
use std::time::Duration;
use v2x_agent::scenario::WorldSource;
use v2x_common::duration::parse_seconds;

/// Shortest run: scoring starts 2 s after every agent's first frame.
const SHORTEST_S: f64 = 4.0;
/// Longest run: an hour.
const LONGEST_S: f64 = 3600.0;
/// Length where none is given.
const DEFAULT: Duration = Duration::from_secs(20);

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x demo                        20 s of the default crossing
  v2x demo --web                  in your browser until Ctrl-C; then the
                                  figures, as ever
  v2x demo --duration 10s --seed 7
  v2x demo ten-agents             another shipped scenario, or a file of yours
  v2x demo --json > summary.json  for a program; everything else goes to
                                  standard error

The exit code is 0 only if every process did its work and, on the objects that
all agents cover, the fused error is below each agent's, and neither recall nor
precision is below 0.8 and below the best agent's.")]
pub(crate) struct DemoArgs {
    /// A scenario file, or the name of a shipped scenario [default: crossing]
    #[arg(value_name = "SCENARIO", conflicts_with = "scenario")]
    named: Option<String>,
    /// How long the agents publish, such as 10s or 2min [default: 20s; with --web until Ctrl-C, an hour at most]
    #[arg(long, value_parser = parse_duration)]
    duration: Option<Duration>,
    /// Seed of the world and of all noise [default: the scenario's]
    #[arg(long, value_parser = v2x_common::seed::parse_seed)]
    pub(crate) seed: Option<u64>,
    /// The same as SCENARIO
    #[arg(long, value_name = "FILE|NAME")]
    scenario: Option<String>,
    /// Another world for the scenario: sumo:CFG runs SUMO, traci:HOST:PORT takes a SUMO that is running
    #[arg(long, value_name = "sumo:CFG")]
    pub(crate) world: Option<WorldSource>,
    /// Print the summary as one line of JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Where the run's folder is made [default: v2x-runs/TIME-SCENARIO]
    #[arg(long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Copy the run's recording to this MCAP file
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Overwrite that file if it exists
    #[arg(long, requires = "record")]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) web: WebArgs,
}

impl DemoArgs {
    /// The scenario that is wanted.
    pub(crate) fn scenario(&self) -> &str {
        self.named.as_deref().or(self.scenario.as_deref()).unwrap_or("crossing")
    }

    /// How long the agents publish at most.
    pub(crate) fn duration(&self) -> Duration {
        let longest = Duration::from_secs_f64(LONGEST_S);
        self.duration.unwrap_or(if self.is_open_ended() { longest } else { DEFAULT })
    }

    /// How long the run is; `None` where Ctrl-C ends it.
    pub(crate) fn length(&self) -> Option<Duration> {
        (!self.is_open_ended()).then(|| self.duration())
    }

    /// Whether who watches ends the run, with Ctrl-C.
    pub(crate) const fn is_open_ended(&self) -> bool {
        self.duration.is_none() && self.web.web.is_some()
    }

    /// Whether Ctrl-C after this time ends the run so that it is scored.
    pub(crate) fn is_scored_after(&self, ran: Duration) -> bool {
        self.is_open_ended() && ran.as_secs_f64() >= SHORTEST_S
    }
}

/// A duration within the limits of a run.
fn parse_duration(text: &str) -> Result<Duration, String> {
    let seconds = parse_seconds(text).map_err(|error| error.to_string())?;
    if (SHORTEST_S..=LONGEST_S).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err(format!("{seconds} s is not between {SHORTEST_S} s and {LONGEST_S} s"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_read_with_their_units() {
        assert_eq!(parse_duration("10s"), Ok(Duration::from_secs(10)));
        assert_eq!(parse_duration("12"), Ok(Duration::from_secs(12)));
        assert_eq!(parse_duration("4500ms"), Ok(Duration::from_millis(4500)));
        assert_eq!(parse_duration("2min"), Ok(Duration::from_secs(120)));
    }

    #[test]
    fn durations_that_are_too_short_too_long_or_unreadable_are_refused() {
        for bad in ["1s", "0", "2h", "10 parsecs", "-5s", "soon", ""] {
            assert!(parse_duration(bad).is_err(), "{bad}");
        }
    }
}
