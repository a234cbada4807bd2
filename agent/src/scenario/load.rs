//! Scenarios from files and texts.

use std::path::Path;

use super::config::Scenario;
use super::error::{Origin, ScenarioError};
use super::files::Files;
use super::validate;

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

    /// Reads a scenario file; paths in it are relative to its folder.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ScenarioError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| ScenarioError::Read { path: path.to_owned(), cause: source })?;
        validate::scenario(&text, Origin::file(path), &Files::beside(path))
    }
}
