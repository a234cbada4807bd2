//! Scenarios from files and texts.

use std::path::Path;

use super::config::Scenario;
use super::error::{Origin, ScenarioError};
use super::validate;

impl Scenario {
    /// Reads a scenario from TOML text; errors say "scenario" instead of a file name.
    pub fn from_toml(text: &str) -> Result<Self, ScenarioError> {
        validate::scenario(text, Origin::default())
    }

    /// Reads a scenario file.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, ScenarioError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| ScenarioError::Read { path: path.to_owned(), cause: source })?;
        validate::scenario(&text, Origin::file(path))
    }
}
