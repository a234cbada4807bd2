//! The folder of a run: its scenario, its recording and its score.
//!
//! | file | content |
//! |---|---|
//! | `about.json` | scenario, local time of the start, version and commit; locked while the run goes on |
//! | `scenario.toml` | the scenario as it was run |
//! | `run.json` | seed, start, duration, the last report of each process |
//! | `recording.mcap` | all messages that the consumer received, and the hub's journal |
//! | `logs/` | the log of each process |
//! | `summary.json`, `report.html`, `report.md`, `bev.svg` | the score |

use crate::commands::run_parts::{check_whole, no_run};
use crate::commands::run_place::{About, RUNS, new_folder, write_about};
use crate::data::hub_inputs::{HubInputs, hub_inputs};
use crate::data::recording::run_log;
use crate::data::run_log::{ReceivedFused, RunLog};
use crate::data::simulation::Simulation;
use crate::drive::rerun::{Rerun, rerun};
use crate::report::markdown::report_md;
use crate::report::output::print;
use crate::report::plot::bev::bev_sheet;
use crate::report::plot::scene::{BevScene, Moment, scene_at};
use crate::report::run_page::{RunPage, run_page};
use crate::report::summary::summary_table;
use crate::score::percentiles::Percentiles;
use crate::score::run::scored_run::{RunFacts, ScoredRun};
use crate::score::run::simulated::score_in_world;
use crate::score::run::summary::Summary;
use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use v2x_agent::scenario::Scenario;
use v2x_common::id::AgentId;
use v2x_common::recording::Recording;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::{HubSettings, HubStatus, Quantiles};

/// The recording of a run, and its name in earlier versions.
const RECORDING: &str = "recording.mcap";
const RECORDING_BEFORE: &str = "consumer.v2xrec";

/// The contents of `run.json`: facts of a run that its recording does not hold.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunRecord {
    /// Seed of the world and of all noise.
    pub seed: u64,
    /// Unix time in µs at which scenario time was 0.
    pub start_us: i64,
    /// Duration of the run, s.
    pub duration_s: f64,
    /// Number of operating-system processes.
    pub processes: usize,
    /// Number of frames that each agent reports as sent.
    pub frames_sent: BTreeMap<AgentId, u64>,
    /// The last status of the hub.
    pub hub: Option<HubStatus>,
    /// Problems, as text for people.
    pub failures: Vec<String>,
}

impl RunRecord {
    fn start(&self) -> anyhow::Result<Timestamp> {
        Timestamp::from_micros(self.start_us).context("run.json: start_us is out of range")
    }
}

/// The folder of one run.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Where it is, if not in the folder.
    recording: Option<PathBuf>,
    // Locked as long as the run goes on.
    _about: Option<File>,
}

impl RunFolder {
    /// Creates the folder and its folder of logs, here or as a new one in [`RUNS`].
    pub fn create(path: Option<&Path>, scenario: &str) -> anyhow::Result<Self> {
        let path = match path {
            Some(path) => path.to_owned(),
            None => new_folder(Path::new(RUNS), scenario)?,
        };
        let logs = path.join("logs");
        std::fs::create_dir_all(&logs).with_context(|| format!("making {}", logs.display()))?;
        // Results of an earlier run in the same folder must not be taken for results of this run.
        for stale in ["run.json", "summary.json", "report.md", "report.html", "bev.svg", "recording.mcap"] {
            match std::fs::remove_file(path.join(stale)) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(error).with_context(|| format!("removing {stale} from {}", path.display()));
                }
                _ => {}
            }
        }
        let about = Some(write_about(&path, scenario)?);
        Ok(Self { path, recording: None, _about: about })
    }

    /// The folder of a run whose recording is elsewhere.
    pub(super) fn of_recording(path: &Path, recording: &Path) -> Self {
        Self { path: path.to_owned(), recording: Some(recording.to_owned()), _about: None }
    }

    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Path of the folder of logs.
    pub fn logs(&self) -> PathBuf {
        self.path.join("logs")
    }

    /// Path of the scenario.
    pub fn scenario(&self) -> PathBuf {
        self.path.join("scenario.toml")
    }

    /// Path of the recording.
    pub fn recording(&self) -> PathBuf {
        self.path.join(RECORDING)
    }

    /// Path of the recording that is there: of a run of an earlier version it has the format of that.
    fn recorded(&self) -> PathBuf {
        if let Some(recording) = &self.recording {
            return recording.clone();
        }
        let before = self.path.join(RECORDING_BEFORE);
        if !self.recording().exists() && before.exists() { before } else { self.recording() }
    }

    /// Writes one file into the folder.
    pub fn write(&self, name: &str, contents: &str) -> anyhow::Result<()> {
        let path = self.path.join(name);
        std::fs::write(&path, contents).with_context(|| format!("writing {}", path.display()))
    }

    /// Writes `run.json`.
    pub fn write_record(&self, record: &RunRecord) -> anyhow::Result<()> {
        self.write("run.json", &serde_json::to_string_pretty(record)?)
    }

    fn read_record(&self) -> anyhow::Result<RunRecord> {
        let path = self.path.join("run.json");
        let text = std::fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
        serde_json::from_str(&text).with_context(|| format!("in {}", path.display()))
    }

    /// The version and commit that recorded the run, where it says so.
    fn commit(&self) -> Option<String> {
        let text = std::fs::read(self.path.join("about.json")).ok()?;
        let About { version, commit, started, .. } = serde_json::from_slice(&text).ok()?;
        Some(format!("Started {started} by version {version}, commit {commit}"))
    }

    /// Whether this is the folder of a run that ended, or the recording of one. Another recording that lies there is not.
    pub(crate) fn is_run(path: &Path) -> bool {
        let is_the_runs = || {
            path.file_name().is_some_and(|name| [RECORDING, RECORDING_BEFORE].map(OsStr::new).contains(&name))
        };
        folder_of(path).join("run.json").is_file() && (path.is_dir() || is_the_runs())
    }

    /// The folder of a recorded run, by its path or that of its recording.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let folder = folder_of(path);
        if !Self::is_run(path) {
            return Err(no_run(path));
        }
        let run = Self { path: folder.to_owned(), recording: None, _about: None };
        check_whole(folder, &run.recorded())?;
        Ok(run)
    }

    /// The hub's settings in the scenario of the folder.
    pub(crate) fn settings(&self) -> anyhow::Result<HubSettings> {
        Ok(HubSettings::from_table(Scenario::load(self.scenario())?.hub)?)
    }

    fn recording_of_run(&self) -> anyhow::Result<Recording<BufReader<File>>> {
        let path = self.recorded();
        Recording::open(&path).with_context(|| format!("opening {}", path.display()))
    }

    fn log(&self) -> anyhow::Result<RunLog> {
        run_log(self.recording_of_run()?).with_context(|| format!("in {}", self.recorded().display()))
    }

    /// Scores the recorded run. Writes summary, reports and picture.
    pub fn score(&self) -> anyhow::Result<Summary> {
        let (log, record) = (self.log()?, self.read_record()?);
        let scenario = Scenario::load(self.scenario())?;
        let simulation = Simulation::new(&scenario, record.seed, record.start()?);
        let scored = score_of(&simulation, &record, &log)?;
        self.write("summary.json", &serde_json::to_string_pretty(&scored.summary)?)?;
        self.write("report.md", &report_md(&scored.summary))?;
        let scene = |moment| {
            let scene = simulation.with_truth(|truth| scene_at(moment, &scored, &log, truth));
            scene.map(|scene| BevScene { roads: simulation.roads(), ..scene })
        };
        let typical = scene(Moment::Typical);
        if let Some(scene) = &typical {
            self.write("bev.svg", &bev_sheet(scene).svg())?;
        }
        let nis = record.hub.iter().flat_map(|hub| &hub.agents);
        let nis = nis.filter_map(|agent| Some((agent.id, agent.nis_per_dof?))).collect();
        let moments: Vec<_> = typical.into_iter().chain(scene(Moment::Worst)).collect();
        let again = self.again().unwrap_or_else(|error| {
            tracing::warn!("the report has no NIS over time: {error:#}");
            Rerun::default()
        });
        let page = RunPage {
            scored: &scored,
            log: &log,
            nis,
            innovations: &again.innovations,
            moments: &moments,
            commit: self.commit(),
        };
        self.write("report.html", &run_page(&page))?;
        Ok(scored.summary)
    }

    /// What the hub's core makes of what the hub was given.
    fn again(&self) -> anyhow::Result<Rerun> {
        let given = hub_inputs(self.recording_of_run()?)?;
        let settings = given.settings.clone().map_or_else(|| self.settings(), Ok)?;
        rerun(&given, settings).context("running the hub's core again")
    }

    /// Whether the scenario's settings of the hub are no longer those of the run; `None` where the recording does not say.
    fn has_other_settings(&self, given: &HubInputs) -> anyhow::Result<Option<bool>> {
        let Some(recorded) = &given.settings else { return Ok(None) };
        let mut wanted = self.settings()?;
        wanted.engine.lineage = recorded.engine.lineage;
        wanted.engine.hub = recorded.engine.hub;
        wanted.tiles = None;
        Ok(Some(wanted != *recorded))
    }

    /// Scores what a hub with these settings makes of the recorded frames, and returns its lists, too. Writes nothing.
    pub(crate) fn rescored_with(
        &self,
        settings: HubSettings,
    ) -> anyhow::Result<(Summary, Vec<ReceivedFused>)> {
        let given = hub_inputs(self.recording_of_run()?)?;
        ensure!(!given.inputs.is_empty(), "the recording holds no frames");
        let mut log = self.log()?;
        log.fused = rerun(&given, settings).context("running the hub again")?.lists;
        let record = self.read_record()?;
        let scenario = Scenario::load(self.scenario())?;
        let simulation = Simulation::new(&scenario, record.seed, record.start()?);
        let mut summary = score_of(&simulation, &record, &log)?.summary;
        // Nothing ran live.
        summary.latency_ms = None;
        summary.compute_ms = None;
        Ok((summary, log.fused))
    }
}

fn folder_of(path: &Path) -> &Path {
    if path.is_file() { path.parent().unwrap_or(path) } else { path }
}

/// The score of a log of a run.
fn score_of(simulation: &Simulation<'_>, record: &RunRecord, log: &RunLog) -> anyhow::Result<ScoredRun> {
    let facts = RunFacts {
        scenario: simulation.name().to_owned(),
        seed: record.seed,
        duration_s: record.duration_s,
        processes: record.processes,
        agents: simulation.agent_facts(|agent| record.frames_sent.get(agent).copied()),
        latency_ms: record.hub.as_ref().and_then(|hub| percentiles(&hub.latency_ms)),
        compute_ms: record.hub.as_ref().and_then(|hub| percentiles(&hub.compute_ms)),
    };
    let mut scored = score_in_world(simulation, log, &facts)?;
    record.failures.iter().for_each(|failure| scored.summary.verdict.fail(failure.clone()));
    Ok(scored)
}

fn percentiles(quantiles: &Quantiles) -> Option<Percentiles> {
    Some(Percentiles { p50: quantiles.p50?, p95: quantiles.p95?, p99: quantiles.p99? })
}

/// Scores a recorded run again and prints the summary. Where the hub's settings were changed since, its frames are put through
/// these.
pub(crate) fn rescore(path: &Path, json: bool) -> anyhow::Result<()> {
    let folder = RunFolder::open(path)?;
    let given = hub_inputs(folder.recording_of_run()?)?;
    let summary = match folder.has_other_settings(&given)? {
        Some(true) => {
            tracing::warn!(
                "the [hub] table of scenario.toml is not that of the run: its frames are fused again with the table as \
                 it is, and the folder's report stays that of the run"
            );
            folder.rescored_with(folder.settings()?)?.0
        }
        Some(false) => folder.score()?,
        None => {
            tracing::warn!(
                "the recording has no journal: what is scored is what the hub published then, \
                            whatever scenario.toml says now"
            );
            folder.score()?
        }
    };
    print_summary(&summary, json)
}

/// Prints a summary on standard output, as text or as one line of JSON.
pub fn print_summary(summary: &Summary, json: bool) -> anyhow::Result<()> {
    let text = if json { serde_json::to_string(summary)? + "\n" } else { summary_table(summary) };
    print(&text).context("writing the summary")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_beside_that_of_a_run_is_no_run() {
        let folder = std::env::temp_dir().join(format!("v2x-run-folder-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["run.json", RECORDING, "other.mcap"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let is_run = |name: &str| RunFolder::is_run(&folder.join(name));
        let found =
            [RunFolder::is_run(&folder), is_run(RECORDING), is_run("other.mcap"), is_run("none.mcap")];
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(found, [true, true, false, false]);
    }
}
