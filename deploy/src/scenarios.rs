//! The scenarios that are shipped with the program, and those of the user.

use anyhow::Context;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use v2x_agent::ScenarioError;
use v2x_agent::nuscenes::TABLES;
use v2x_agent::scenario::{
    Rider, Scenario, ScenarioFile, Sumo, WorldSource, folder_of_tables, open_traffic, recorded_world,
    with_paths, with_world, without_riders,
};
use v2x_agent::trajectories::ReadOptions;
use v2x_common::shipped;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::hub::HubSettings;
use v2x_lab::commands::{RunFolder, log_remarks};

/// Larger files of a world are not copied into the folder of each run, bytes.
const MAX_COPY: u64 = 64 << 20;
/// What was recorded of a world that SUMO drove, in the folder of a run.
const RECORDED_WORLD: &str = "world-file.csv";

/// A scenario whose tables were all checked, with its text, which the processes of a run read again.
#[derive(Debug)]
pub(crate) struct Chosen {
    pub(crate) text: String,
    pub(crate) scenario: Scenario,
}

impl Chosen {
    /// Writes the scenario into the folder of a run, with the files of its world, so that the run can be scored later and
    /// elsewhere. Of large files the text has the path.
    pub(crate) fn write(&self, folder: &RunFolder) -> anyhow::Result<()> {
        if let Some(sumo) = &self.scenario.sumo {
            return folder.write("scenario.toml", &with_world(&self.text, sumo.source.table())?);
        }
        let mut paths = Vec::new();
        for ScenarioFile { key, path } in &self.scenario.files {
            let reading = || format!("reading {}", path.display());
            let meta = path.metadata().with_context(reading)?;
            let new = if meta.is_dir() {
                match copy_tables(path, folder.path(), key).with_context(reading)? {
                    Some(copy) => copy,
                    None => path.canonicalize().with_context(reading)?,
                }
            } else if meta.len() <= MAX_COPY {
                let suffix = path.extension().and_then(OsStr::to_str).unwrap_or("txt");
                let name = format!("world-{key}.{suffix}");
                std::fs::copy(path, folder.path().join(&name)).with_context(reading)?;
                PathBuf::from(name)
            } else {
                path.canonicalize().with_context(reading)?
            };
            paths.push((*key, new));
        }
        let new =
            |key: &str, _: &str| paths.iter().find(|(known, _)| *known == key).map(|(_, path)| path.clone());
        folder.write("scenario.toml", &with_paths(&self.text, new))
    }

    /// The files of the folder of a run that its world needs, by their names there; none where SUMO drives it, whose world is known
    /// afterwards.
    pub(crate) fn belongings(&self, folder: &RunFolder) -> anyhow::Result<Vec<String>> {
        let mut names = Vec::new();
        if self.scenario.sumo.is_some() {
            return Ok(names);
        }
        names.push("scenario.toml".to_owned());
        for ScenarioFile { key, .. } in &self.scenario.files {
            let prefix = format!("world-{key}");
            let entries =
                std::fs::read_dir(folder.path()).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
            for entry in entries.with_context(|| format!("reading {}", folder.path().display()))? {
                let Ok(name) = entry.file_name().into_string() else { continue };
                let is_tables = name == prefix && entry.path().is_dir();
                if is_tables {
                    names.extend(TABLES.map(|table| format!("{name}/{table}.json")));
                } else if name.strip_prefix(&prefix).is_some_and(|rest| rest.starts_with('.')) {
                    names.push(name);
                }
            }
        }
        Ok(names)
    }

    /// Where the world of a run is recorded, if SUMO drives it.
    pub(crate) fn sumo<'a>(&'a self, folder: &RunFolder) -> Option<(&'a Sumo, PathBuf)> {
        self.scenario.sumo.as_ref().map(|sumo| (sumo, folder.path().join(RECORDED_WORLD)))
    }

    /// After a run that SUMO drove: the scenario of the folder has what was recorded of it as its world.
    pub(crate) fn keep_world(&self, folder: &RunFolder) -> anyhow::Result<()> {
        if self.scenario.sumo.is_none() {
            return Ok(());
        }
        let world = recorded_world(RECORDED_WORLD, &self.scenario.world.roads());
        let mut text = with_world(&self.text, world)?;
        // An agent whose object never came was nowhere, and a recorded world has to know what is ridden on. Where the
        // recording itself cannot be read, that is said when the run is scored.
        let recorded = open_traffic(&folder.path().join(RECORDED_WORLD), &ReadOptions::default());
        if let Ok(recorded) = recorded {
            let is_there = |name: &str| recorded.objects.iter().any(|object| object.name == name);
            let (without, gone) = without_riders(&text, is_there)?;
            text = without;
            for Rider { agent, ride } in gone {
                tracing::warn!(
                    "agent {agent} rides on {ride:?}, which never came; the run's scenario is without it"
                );
            }
        }
        folder.write("scenario.toml", &text)
    }

    /// Scenario time 0 of a network that begins now: agents that are started by hand have the same where the world repeats
    /// itself, and one that ends begins with its first row.
    pub(crate) fn start(&self, now: Timestamp) -> Timestamp {
        if self.scenario.world.repeats() { now.floor_to(self.scenario.loop_length) } else { now }
    }
}

/// Copies the tables of nuScenes that are read, if they are small; the new folder as the scenario names it.
fn copy_tables(tables: &Path, run: &Path, key: &str) -> anyhow::Result<Option<PathBuf>> {
    let tables = folder_of_tables(tables)?;
    let file = |table: &str| tables.join(table).with_extension("json");
    let mut length = 0;
    for table in TABLES {
        length += file(table).metadata()?.len();
    }
    if length > MAX_COPY {
        return Ok(None);
    }
    let name = PathBuf::from(format!("world-{key}"));
    std::fs::create_dir_all(run.join(&name))?;
    for table in TABLES {
        std::fs::copy(file(table), run.join(&name).join(table).with_extension("json"))?;
    }
    Ok(Some(name))
}

/// The scenario of a file, or a shipped one by name. The hub's settings are checked with it. What is to be said about
/// recorded traffic is logged.
pub(crate) fn choose(name_or_file: &str) -> anyhow::Result<Chosen> {
    choose_in(name_or_file, None)
}

/// The same with another world.
pub(crate) fn choose_in(name_or_file: &str, world: Option<&WorldSource>) -> anyhow::Result<Chosen> {
    let path = Path::new(name_or_file);
    let scenario = match world {
        Some(world) => Scenario::load_in(path, world),
        None => Scenario::load(path),
    };
    let scenario = match scenario {
        // All others name the scenario themselves.
        Err(error @ ScenarioError::Traffic { .. }) => {
            return Err(error).with_context(|| format!("scenario {name_or_file}"));
        }
        scenario => scenario?,
    };
    let text = shipped::read(path).with_context(|| format!("reading {}", path.display()))?.into_owned();
    HubSettings::from_table(scenario.hub.clone()).with_context(|| format!("scenario {name_or_file}"))?;
    log_remarks(&scenario);
    Ok(Chosen { text, scenario })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_scenario_is_valid() {
        for (name, _) in shipped::SHIPPED {
            let chosen = choose(name).unwrap();
            assert_eq!(chosen.scenario.name, name);
        }
    }

    #[test]
    fn a_missing_file_is_named_with_the_shipped_scenarios() {
        let message = format!("{:#}", choose("no-such.toml").unwrap_err());
        assert!(message.contains("no-such.toml") && message.contains("crossing"), "{message}");
    }
}
