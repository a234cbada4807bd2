//! What a scenario file means: complete, checked, in SI units.

use std::path::PathBuf;
use std::sync::Arc;

use v2x_common::id::AgentId;
use v2x_common::time::Span;

use super::edit::WorldSource;
use crate::sending::{Sender, SendingConfig};
use crate::sensor::{Boot, Sensor, SensorConfig, SensorError};
use crate::world::{Station, World, WorldAgent, WorldConfig, WorldParameters};

/// A checked scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Its name, for people.
    pub name: String,
    /// The world's period: every object is where it was one period before; of recorded traffic its length.
    pub loop_length: Span,
    /// The seed that is used where no other is given.
    pub seed: u64,
    /// Roads and population of the world.
    pub world: WorldConfig,
    /// The agents, in the file's order; ids are unique.
    pub agents: Vec<AgentConfig>,
    /// The hub's settings as they are in the file: this crate does not interpret them.
    pub hub: toml::Table,
    /// The files that the world was read from.
    pub files: Vec<ScenarioFile>,
    /// SUMO, where it drives the world.
    pub sumo: Option<Sumo>,
}

/// SUMO as the world of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Sumo {
    /// Which one.
    pub source: WorldSource,
    /// Its time at which the world begins, s; without one that of its configuration.
    pub begin_s: Option<f64>,
}

/// A file that a scenario names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioFile {
    /// The key of the `[world]` table that names it.
    pub key: &'static str,
    /// Where it is.
    pub path: PathBuf,
}

/// A world that happens elsewhere, for a command that has to know it before.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "SUMO drives this world while it is run, so that {command} cannot know it; take the scenario in the folder of a run of \
     v2x up, which has what was recorded of it, or SUMO's own file:  sumo -c CFG --fcd-output fcd.xml"
)]
pub struct UnknownWorld {
    /// The command.
    pub command: &'static str,
}

/// One agent: where it is, what it detects, how it sends.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentConfig {
    /// Where it is.
    pub station: Station,
    /// Its sensor, with its name in the network.
    pub sensor: SensorConfig,
    /// How its frames are sent.
    pub sending: SendingConfig,
}

impl Scenario {
    /// All that the world depends on, apart from the seed.
    pub fn world_parameters(&self) -> WorldParameters {
        let agents = self.agents.iter().map(AgentConfig::in_world).collect();
        WorldParameters { loop_length: self.loop_length, config: self.world.clone(), agents }
    }

    /// The world of the run with this seed, which may differ from the scenario's own.
    ///
    /// # Panics
    /// If a field was changed to a value that a scenario file must not have.
    pub fn world(&self, seed: u64) -> World {
        World::new(&self.world_parameters(), seed).expect("a scenario is checked when it is read")
    }

    /// The error of a command that needs the world before it happens.
    pub fn check_known(&self, command: &'static str) -> Result<(), UnknownWorld> {
        if self.world.is_live() { Err(UnknownWorld { command }) } else { Ok(()) }
    }

    /// The place of an agent in `agents`.
    pub fn agent_index(&self, id: &AgentId) -> Option<usize> {
        self.agents.iter().position(|agent| agent.id() == *id)
    }
}

impl AgentConfig {
    /// Its name in the network.
    pub const fn id(&self) -> AgentId {
        self.sensor.agent
    }

    /// Its sensor in a world of the scenario.
    pub fn sensor(&self, world: Arc<World>, boot: Boot) -> Result<Sensor, SensorError> {
        Sensor::new(self.sensor.clone(), world, boot)
    }

    /// Its sensor and its connection to the network.
    pub fn sender(&self, world: Arc<World>, boot: Boot) -> Result<Sender, SensorError> {
        Ok(Sender::new(self.sensor(world, boot)?, self.sending.clone()))
    }

    fn in_world(&self) -> WorldAgent {
        WorldAgent { id: self.sensor.agent, kind: self.sensor.kind, station: self.station.clone() }
    }
}
