//! The folder of a run: its scenario, its recording and its score.
//!
//! | file | content |
//! |---|---|
//! | `about.json` | scenario, local time of the start, version and commit; locked while the run goes on |
//! | `scenario.toml` | the scenario as it was run |
//! | `run.json` | seed, start, duration, the last report of each process |
//! | `consumer.v2xrec` | all messages that the consumer received |
//! | `logs/` | the log of each process |
//! | `summary.json`, `report.html`, `report.md`, `bev.svg` | the score |

use crate::commands::run_place::{About, RUNS, new_folder, write_about};
use crate::data::recording::run_log;
use crate::data::simulation::Simulation;
use crate::report::markdown::report_md;
use crate::report::output::print;
use crate::report::plot::bev::bev_svg;
use crate::report::plot::scene::{Moment, scene_at};
use crate::report::run_page::{RunPage, run_page};
use crate::report::summary::summary_table;
use crate::score::percentiles::Percentiles;
use crate::score::run::scored_run::RunFacts;
use crate::score::run::simulated::score_in_world;
use crate::score::run::summary::Summary;
use anyhow::Context;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use v2x_agent::scenario::Scenario;
use v2x_common::id::AgentId;
use v2x_common::recording::Recording;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::{HubStatus, Quantiles};

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

/// The folder of one run.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
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
        for stale in ["run.json", "summary.json", "report.md", "report.html", "bev.svg"] {
            match std::fs::remove_file(path.join(stale)) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(error).with_context(|| format!("removing {stale} from {}", path.display()));
                }
                _ => {}
            }
        }
        let about = Some(write_about(&path, scenario)?);
        Ok(Self { path, _about: about })
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
        self.path.join("consumer.v2xrec")
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
        Some(format!("started {started} by version {version}, commit {commit}"))
    }

    /// The folder of a recorded run, by its path or that of its recording.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let folder = if path.is_file() { path.parent().unwrap_or(path) } else { path };
        let is_run = folder.join("run.json").is_file();
        anyhow::ensure!(
            is_run,
            "{} is no folder of a run that ended: it has no run.json; `v2x demo` makes one, `v2x runs` lists them",
            folder.display()
        );
        Ok(Self { path: folder.to_owned(), _about: None })
    }

    /// Scores the recorded run. Writes summary, reports and picture.
    pub fn score(&self) -> anyhow::Result<Summary> {
        let record = self.read_record()?;
        let scenario = Scenario::load(self.scenario())?;
        let path = self.recording();
        let file = File::open(&path).with_context(|| format!("opening {}", path.display()))?;
        let log = run_log(Recording::new(BufReader::new(file))?)?;
        let start = Timestamp::from_micros(record.start_us).context("run.json: start_us is out of range")?;
        let simulation = Simulation::new(&scenario, record.seed, start);
        let facts = RunFacts {
            scenario: scenario.name.clone(),
            seed: record.seed,
            duration_s: record.duration_s,
            processes: record.processes,
            agents: simulation.agent_facts(|agent| record.frames_sent.get(agent).copied()),
            latency_ms: record.hub.as_ref().and_then(|hub| percentiles(&hub.latency_ms)),
            compute_ms: record.hub.as_ref().and_then(|hub| percentiles(&hub.compute_ms)),
        };
        let mut scored = score_in_world(&simulation, &log, &facts)?;
        record.failures.into_iter().for_each(|failure| scored.summary.verdict.fail(failure));
        let scene = |moment| simulation.with_truth(|truth| scene_at(moment, &scored, &log, truth));
        let typical = scene(Moment::Typical);
        if let Some(scene) = &typical {
            self.write("bev.svg", &bev_svg(scene))?;
        }
        let nis = record.hub.iter().flat_map(|hub| &hub.agents);
        let nis = nis.filter_map(|agent| Some((agent.id, agent.nis_per_dof?))).collect();
        let moments: Vec<_> = typical.into_iter().chain(scene(Moment::Worst)).collect();
        let page = RunPage { scored: &scored, log: &log, nis, moments: &moments, commit: self.commit() };
        self.write("report.html", &run_page(&page))?;
        self.write("summary.json", &serde_json::to_string_pretty(&scored.summary)?)?;
        self.write("report.md", &report_md(&scored.summary))?;
        Ok(scored.summary)
    }
}

fn percentiles(quantiles: &Quantiles) -> Option<Percentiles> {
    Some(Percentiles { p50: quantiles.p50?, p95: quantiles.p95?, p99: quantiles.p99? })
}

/// Scores a recorded run again and prints the summary.
pub(crate) fn rescore(folder: &Path, json: bool) -> anyhow::Result<()> {
    let summary = RunFolder::open(folder)?.score()?;
    print_summary(&summary, json)
}

/// Prints a summary on standard output, as text or as one line of JSON.
pub fn print_summary(summary: &Summary, json: bool) -> anyhow::Result<()> {
    let text = if json { serde_json::to_string(summary)? + "\n" } else { summary_table(summary) };
    print(&text).context("writing the summary")
}
