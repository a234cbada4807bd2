//! Scenarios from files and texts.

use std::ffi::OsStr;
use std::path::Path;

use super::config::Scenario;
use super::edit::{WorldSource, with_world};
use super::error::{Origin, ScenarioError};
use super::files::Files;
use super::validate;
use v2x_common::shipped;

/// Suffixes of recorded traffic, which is a part of a scenario and none itself.
const TRAFFIC: [&str; 4] = ["csv", "tsv", "txt", "xml"];

/// Recorded traffic in place of a scenario is told what makes a scenario of it.
fn check_kind(path: &Path) -> Result<(), ScenarioError> {
    let is_traffic = |suffix: &OsStr| TRAFFIC.iter().any(|one| suffix.eq_ignore_ascii_case(one));
    if path.is_dir() || path.exists() && path.extension().is_some_and(is_traffic) {
        return Err(ScenarioError::IsTraffic { path: path.to_owned() });
    }
    Ok(())
}

impl Scenario {
    /// Reads a scenario from TOML text; errors say "scenario" instead of a file name, and paths are relative to the present
    /// folder.
    pub fn from_toml(text: &str) -> Result<Self, ScenarioError> {
        Self::from_toml_with(text, &Files::default())
    }

    /// The same with files that are elsewhere, or that were read before.
    pub fn from_toml_with(text: &str, files: &Files) -> Result<Self, ScenarioError> {
        validate::scenario(text, Origin::default(), files)
    }

    /// The same as [`Self::load`] with another world.
    pub fn load_in(path: impl AsRef<Path>, world: &WorldSource) -> Result<Self, ScenarioError> {
        let path = path.as_ref();
        check_kind(path)?;
        let text = shipped::read(path)
            .map_err(|source| ScenarioError::Read { path: path.to_owned(), cause: source })?;
        let text = with_world(&text, world.table())
            .map_err(|cause| ScenarioError::World { path: path.to_owned(), cause: Box::new(cause) })?;
        validate::scenario(&text, Origin::file(path), &Files::beside(path))
            .map_err(ScenarioError::without_place)
    }

    /// Reads a scenario file, or a shipped scenario by its name; paths in a file are relative to its folder.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ScenarioError> {
        let path = path.as_ref();
        if let Some(text) = shipped::named(path) {
            return Self::from_toml(text);
        }
        check_kind(path)?;
        let text = shipped::read(path)
            .map_err(|source| ScenarioError::Read { path: path.to_owned(), cause: source })?;
        validate::scenario(&text, Origin::file(path), &Files::beside(path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recorded_traffic_in_place_of_a_scenario_is_told_the_command_that_makes_one_of_it() {
        let traffic = std::env::temp_dir().join(format!("v2x-load-{}.csv", std::process::id()));
        std::fs::write(&traffic, "t,id,class,x,y\n0,a,car,0,0\n").unwrap();
        let refused = Scenario::load(&traffic).unwrap_err().to_string();
        std::fs::remove_file(&traffic).unwrap();
        assert!(refused.contains(&format!("v2x scenario init --world {}", traffic.display())), "{refused}");
        let of_a_folder = Scenario::load(std::env::temp_dir()).unwrap_err().to_string();
        assert!(of_a_folder.contains("v2x scenario init --world"), "{of_a_folder}");
        assert!(Scenario::load("no-such.csv").unwrap_err().to_string().contains("no scenario file"));
    }
}
