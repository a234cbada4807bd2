//! Scenario files: which world, which agents, which links. TOML; units stand in the field names.
//!
//! What was typed is `typed`'s business, what it means is a [`Scenario`]: in SI, complete, checked.

mod agent;
mod error;
mod typed;
mod validate;

use std::path::Path;

use v2x_common::id::{AgentId, MapFrame};
use v2x_common::time::Span;

pub use agent::{AgentConfig, Phase, Rate, Route, Station};
pub use error::{Origin, ScenarioError};

use crate::world::{CrossingConfig, HighwayConfig};

/// A checked scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Its name, for people.
    pub name: String,
    /// The world's period: everything is where it was one period before.
    pub loop_length: Span,
    /// The seed that is used where none is given from outside.
    pub seed: u64,
    /// The name of the coordinate frame, if it has one.
    pub map_frame: Option<MapFrame>,
    /// The world.
    pub world: WorldConfig,
    /// The agents, in the file's order; ids are unique.
    pub agents: Vec<AgentConfig>,
    /// The hub's settings, unread: this crate knows nothing of hubs.
    pub hub: toml::Table,
}

/// Which world, with its knobs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WorldConfig {
    /// Two roads that cross, with traffic lights, sidewalks and blocks around.
    Crossing(CrossingConfig),
    /// A straight motorway.
    Highway(HighwayConfig),
}

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

    /// The place of an agent in `agents`.
    pub fn agent_index(&self, id: &AgentId) -> Option<usize> {
        self.agents.iter().position(|agent| agent.id == *id)
    }
}

#[cfg(test)]
mod tests;
