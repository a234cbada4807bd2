//! What determines a world.

use std::sync::Arc;

use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::sensor::SensorKind;
use v2x_common::time::Span;

use super::crossing::CrossingConfig;
use super::error::InvalidParameter;
use super::highway::HighwayConfig;
use super::recorded::{Course, RecordedWorld};
use crate::trajectories::Trajectory;

/// All that a world depends on, apart from the seed.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldParameters {
    /// Period: every object is where it was one period before. At least 100 s; of a recording its length.
    pub loop_length: Span,
    /// Roads and population.
    pub config: WorldConfig,
    /// The agents; ids are unique, and each route has room for those on it.
    pub agents: Vec<WorldAgent>,
}

/// Roads and population of a world.
#[derive(Clone, Debug, PartialEq)]
pub enum WorldConfig {
    /// Two roads that cross, with traffic lights, sidewalks and blocks around.
    Crossing(CrossingConfig),
    /// A straight motorway.
    Highway(HighwayConfig),
    /// What was recorded.
    Recorded(RecordedWorld),
}

impl WorldConfig {
    /// Whether it begins again after its length.
    pub fn repeats(&self) -> bool {
        match self {
            Self::Crossing(_) | Self::Highway(_) => true,
            Self::Recorded(recorded) => matches!(recorded.course, Course::Repeats),
        }
    }

    /// Whether another program drives it, so that only what it has published is known.
    pub fn is_live(&self) -> bool {
        self.recorded().is_some_and(RecordedWorld::is_live)
    }

    /// The recording that it is.
    pub const fn recorded(&self) -> Option<&RecordedWorld> {
        match self {
            Self::Recorded(recorded) => Some(recorded),
            Self::Crossing(_) | Self::Highway(_) => None,
        }
    }
}

/// An agent as far as the world is concerned.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldAgent {
    /// Its name.
    pub id: AgentId,
    /// A vehicle is itself an object of the world.
    pub kind: SensorKind,
    /// Where it is.
    pub station: Station,
}

impl WorldParameters {
    /// Checks every number, that ids are unique, and that each route is one of these roads and has room.
    pub fn validate(&self) -> Result<(), InvalidParameter> {
        let loop_s = self.loop_length.as_secs_f64();
        let (is_valid, expected) = match &self.config {
            WorldConfig::Recorded(world) => {
                let is_valid = world.is_live() || self.loop_length == world.traffic.length;
                (is_valid, "the recording's length")
            }
            _ => ((100.0..=3600.0).contains(&loop_s), "100 to 3600 s"),
        };
        InvalidParameter::check("loop_length", &self.loop_length, is_valid, expected)?;
        match &self.config {
            WorldConfig::Crossing(config) => config.validate()?,
            WorldConfig::Highway(config) => config.validate()?,
            WorldConfig::Recorded(_) => {}
        }
        for (index, agent) in self.agents.iter().enumerate() {
            let others = &self.agents[..index];
            let is_new = others.iter().all(|other| other.id != agent.id);
            InvalidParameter::check("agents", &agent.id, is_new, "an id that no other agent has")?;
            if let Station::Riding(object) = &agent.station {
                let world = self.config.recorded();
                // Who is driven elsewhere may come later.
                let is_there =
                    world.is_some_and(|world| world.is_live() || world.object_id(object).is_some());
                InvalidParameter::check("ride", object, is_there, "an object of the recording")?;
            }
            let Station::Driving(route) = agent.station else { continue };
            let n_before = others.iter().filter(|other| other.station == agent.station).count();
            let fits = route.is_of(&self.config) && n_before < route.capacity();
            InvalidParameter::check("route", &agent.id, fits, "a route of these roads, with room")?;
        }
        Ok(())
    }
}

/// How an agent is placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub enum Station {
    /// At rest, in the map frame.
    Fixed(Pose),
    /// On a route of the world.
    Driving(Route),
    /// On an object of a recording by its name there, which is its body.
    Riding(String),
    /// Along a way of its own.
    Following(Arc<Trajectory>),
}

/// A closed route for agents that drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// Clockwise around one block of the crossing, through the crossing once in each cycle of the
    /// lights. The number is the arm from which the crossing is entered: 0 east, 1 north, 2 west, 3 south.
    Block(u8),
    /// Along the motorway and back on the service road beside it. 0: east on the southern side; 1: west
    /// on the northern side.
    Service(u8),
}

impl Route {
    const ALL: [(&str, Self); 6] = [
        ("block-ne", Self::Block(0)),
        ("block-nw", Self::Block(1)),
        ("block-sw", Self::Block(2)),
        ("block-se", Self::Block(3)),
        ("service-south", Self::Service(0)),
        ("service-north", Self::Service(1)),
    ];

    /// The route of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, route)| *route)
    }

    /// Whether it lies on these roads.
    pub const fn is_of(self, config: &WorldConfig) -> bool {
        match self {
            Self::Block(arm) => arm < 4 && matches!(config, WorldConfig::Crossing(_)),
            Self::Service(side) => side < 2 && matches!(config, WorldConfig::Highway(_)),
        }
    }

    /// Number of agents that have room on it.
    pub const fn capacity(self) -> usize {
        match self {
            Self::Block(_) => 2,
            Self::Service(_) => 4,
        }
    }
}
