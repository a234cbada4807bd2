//! A recording that brings its scenario along: a run, as the folder of one is.

use crate::commands::run_folder::{RunFolder, RunRecord};
use crate::commands::run_place::About;
use anyhow::{Context, bail};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use v2x_common::recording::{Recording, RecordingError};
use v2x_common::time::Timestamp;

/// The attachment that makes a run of a recording.
const SCENARIO: &str = "scenario.toml";

/// The folder of a run, made of a recording; it is removed with this value.
pub(super) struct RecordedRun {
    folder: RunFolder,
    place: PathBuf,
}

impl RecordedRun {
    /// `None` of a recording without a scenario.
    ///
    /// # Errors
    /// Where it cannot be read, or the folder cannot be written.
    pub(super) fn unpack(recording: &Path) -> anyhow::Result<Option<Self>> {
        let in_file = || format!("in {}", recording.display());
        let mut read = Recording::open(recording).with_context(in_file)?;
        let Some(first) = read.next().transpose().with_context(in_file)? else { return Ok(None) };
        let (facts, attachments) = (read.facts(), read.attachments());
        if !attachments.contains_key(SCENARIO) {
            return Ok(None);
        }
        let mut last = first.received_at;
        for entry in read {
            match entry {
                Ok(entry) => last = last.max(entry.received_at),
                Err(RecordingError::Unfinished { .. }) => break,
                Err(error) => return Err(error).with_context(in_file),
            }
        }
        let record = record(&facts, (last - first.received_at).as_secs_f64()).with_context(in_file)?;
        let place = new_place()?;
        let run = Self { folder: RunFolder::of_recording(&place, recording), place };
        run.folder.write_record(&record)?;
        run.folder.write("about.json", &serde_json::to_string(&about(&facts, first.received_at))?)?;
        for (name, data) in &attachments {
            run.write(name, data)?;
        }
        Ok(Some(run))
    }

    pub(super) const fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// Files of the scenario alone, and within the folder, whatever a recording says.
    fn write(&self, name: &str, data: &[u8]) -> anyhow::Result<()> {
        let is_within = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        if !is_within || !(name == SCENARIO || name.starts_with("world-")) {
            return Ok(());
        }
        let path = self.place.join(name);
        let write = || {
            path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
            std::fs::write(&path, data)
        };
        write().with_context(|| format!("writing {}", path.display()))
    }
}

impl Drop for RecordedRun {
    fn drop(&mut self) {
        // What is left lies among temporary files.
        let _ = std::fs::remove_dir_all(&self.place);
    }
}

fn new_place() -> anyhow::Result<PathBuf> {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    let place = std::env::temp_dir().join(format!("v2x-recorded-run-{}-{number}", std::process::id()));
    std::fs::create_dir(&place).with_context(|| format!("making {}", place.display()))?;
    Ok(place)
}

/// The run, by the facts that the recording holds.
fn record(facts: &BTreeMap<String, String>, duration_s: f64) -> anyhow::Result<RunRecord> {
    let number = |key: &str| {
        let Some(text) = facts.get(key) else { bail!("the recording has a scenario and no {key}") };
        text.parse::<i64>().with_context(|| format!("{key} = {text:?}"))
    };
    Ok(RunRecord {
        seed: facts
            .get("seed")
            .context("the recording has a scenario and no seed")?
            .parse()
            .context("seed")?,
        start_us: number("start_us")?,
        duration_s,
        processes: usize::try_from(number("processes")?).context("processes")?,
        frames_sent: BTreeMap::new(),
        hub: None,
        failures: Vec::new(),
    })
}

fn about(facts: &BTreeMap<String, String>, began_at: Timestamp) -> About {
    let fact = |key: &str| facts.get(key).cloned().unwrap_or_default();
    let started = jiff::Timestamp::from_microsecond(began_at.as_micros());
    let started =
        started.map_or_else(|_| String::new(), |started| started.strftime("%Y-%m-%dT%H:%M:%SZ").to_string());
    About { scenario: String::new(), started, version: fact("version"), commit: fact("commit") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::recording::{Entry, RecordingFile, RecordingOptions};
    use v2x_common::time::Span;

    fn recording(name: &str, attachments: &[(&str, &str)]) -> PathBuf {
        let path = std::env::temp_dir().join(format!("v2x-{name}-{}.mcap", std::process::id()));
        let facts = [("seed", "7"), ("start_us", "1000000"), ("processes", "4"), ("commit", "abc")];
        let options = RecordingOptions {
            overwrite: true,
            facts: facts.map(|(key, value)| (key.to_owned(), value.to_owned())).into(),
            attachments: attachments
                .iter()
                .map(|(name, text)| ((*name).to_owned(), text.as_bytes().to_vec()))
                .collect(),
            ..RecordingOptions::default()
        };
        let mut file = RecordingFile::create(&path, options).unwrap();
        for ms in [0, 2500] {
            let received_at = Timestamp::EPOCH + Span::from_millis(ms);
            let key = "v2x/demo/agent/ego/detections".to_owned();
            file.write(&Entry { received_at, key, encoding: String::new(), payload: Vec::new() }).unwrap();
        }
        file.finish().unwrap();
        path
    }

    #[test]
    fn a_recording_with_a_scenario_is_the_folder_of_a_run_and_leaves_nothing_behind() {
        let path = recording("with-scenario", &[("scenario.toml", "name = 'x'"), ("world-file.csv", "t,id")]);
        let run = RecordedRun::unpack(&path).unwrap().unwrap();
        let text = |name: &str| std::fs::read_to_string(run.place.join(name)).unwrap();
        assert_eq!((text("scenario.toml"), text("world-file.csv")), ("name = 'x'".into(), "t,id".into()));
        let record: RunRecord = serde_json::from_str(&text("run.json")).unwrap();
        assert_eq!(
            (record.seed, record.start_us, record.duration_s, record.processes),
            (7, 1_000_000, 2.5, 4)
        );
        let place = run.place.clone();
        drop(run);
        assert!(!place.exists());
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn nothing_is_written_outside_of_the_folder_whatever_a_recording_names() {
        let outside = format!("world-{}.csv", std::process::id());
        let names = [format!("../{outside}"), format!("/tmp/{outside}"), format!("world-a/../../{outside}")];
        let mut attachments = vec![("scenario.toml", ""), ("run.json", "{}")];
        attachments.extend(names.iter().map(|name| (name.as_str(), "stolen")));
        let path = recording("outside", &attachments);
        let run = RecordedRun::unpack(&path).unwrap().unwrap();
        let files: Vec<_> =
            std::fs::read_dir(&run.place).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(files.len(), 3, "{files:?}");
        assert!(!std::env::temp_dir().join(&outside).exists());
        assert!(std::fs::read_to_string(run.place.join("run.json")).unwrap().contains("seed"));
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn a_recording_without_a_scenario_is_no_run() {
        let path = recording("without", &[]);
        assert!(RecordedRun::unpack(&path).unwrap().is_none());
        std::fs::remove_file(path).unwrap();
    }
}
