//! Scenarios from files and texts.

use std::path::Path;

use super::config::Scenario;
use super::edit::{WorldSource, with_world};
use super::error::{Origin, ScenarioError};
use super::files::Files;
use super::validate;
use v2x_common::shipped;

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
        let text = shipped::read(path)
            .map_err(|source| ScenarioError::Read { path: path.to_owned(), cause: source })?;
        validate::scenario(&text, Origin::file(path), &Files::beside(path))
    }
}
