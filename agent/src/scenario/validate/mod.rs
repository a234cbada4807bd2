//! From what was typed to what it means: defaults, units, limits.

use std::fmt::Display;

use v2x_common::id::MapFrame;
use v2x_common::time::Span;

use super::typed::{TypedScenario, TypedWorld, WorldKind};
use super::{AgentConfig, Origin, Scenario, ScenarioError, Station, WorldConfig};
use crate::world::{CrossingConfig, HighwayConfig, crossing, highway};

mod agent;
mod pose;
mod sending;

const DEFAULT_LOOP_S: f64 = 120.0;
const DEFAULT_SEED: u64 = 1;

pub(super) fn scenario(text: &str, origin: Origin) -> Result<Scenario, ScenarioError> {
    let typed: TypedScenario = match toml::from_str(text) {
        Ok(typed) => typed,
        Err(source) => return Err(ScenarioError::Syntax { origin, cause: Box::new(source) }),
    };
    Field { origin: &origin, path: String::new() }.scenario(typed)
}

/// A place in the file, for errors.
struct Field<'a> {
    origin: &'a Origin,
    path: String,
}

impl Field<'_> {
    fn child(&self, name: impl Display) -> Self {
        let path = if self.path.is_empty() { name.to_string() } else { format!("{}.{name}", self.path) };
        Self { origin: self.origin, path }
    }

    fn error(&self, value: impl Display, expected: impl Display) -> ScenarioError {
        ScenarioError::Value {
            origin: self.origin.clone(),
            field: self.path.clone(),
            value: value.to_string(),
            expected: expected.to_string(),
        }
    }

    /// The number in the child `name`, if `ok` (which NaN must fail).
    fn number(&self, name: &str, value: f64, ok: bool, expected: &str) -> Result<f64, ScenarioError> {
        if ok && value.is_finite() { Ok(value) } else { Err(self.child(name).error(value, expected)) }
    }

    fn scenario(&self, typed: TypedScenario) -> Result<Scenario, ScenarioError> {
        let loop_s = typed.loop_s.unwrap_or(DEFAULT_LOOP_S);
        self.number("loop_s", loop_s, (100.0..=3600.0).contains(&loop_s), "100 to 3600")?;
        let map_frame = typed.map_frame.map(|name| {
            MapFrame::new(&name)
                .map_err(|cause| self.child("map_frame").error(format_args!("{name:?}"), cause))
        });
        let world = self.child("world").world(&typed.world)?;
        if typed.agents.is_empty() {
            return Err(self.child("agents").error("empty", "at least one agent"));
        }
        let mut agents: Vec<AgentConfig> = Vec::with_capacity(typed.agents.len());
        for (index, agent) in typed.agents.into_iter().enumerate() {
            let field = self.child(format_args!("agents[{index}]"));
            let agent = field.agent(agent, &world)?;
            field.fits_beside(&agent, &agents)?;
            agents.push(agent);
        }
        Ok(Scenario {
            name: typed.name,
            loop_length: Span::from_secs_f64(loop_s),
            seed: typed.seed.unwrap_or(DEFAULT_SEED),
            map_frame: map_frame.transpose()?,
            world,
            agents,
            hub: typed.hub,
        })
    }

    fn world(&self, typed: &TypedWorld) -> Result<WorldConfig, ScenarioError> {
        match typed.kind {
            WorldKind::Crossing => {
                self.foreign("lanes", typed.lanes, "crossing")?;
                let default = CrossingConfig::default();
                Ok(WorldConfig::Crossing(CrossingConfig {
                    traffic: self.traffic(typed.traffic.unwrap_or(default.traffic))?,
                    parked: self.count(
                        "parked",
                        typed.parked.unwrap_or(default.parked),
                        crossing::MAX_PARKED,
                    )?,
                    works: self.count("works", typed.works.unwrap_or(default.works), crossing::MAX_WORKS)?,
                    pedestrians: self.count(
                        "pedestrians",
                        typed.pedestrians.unwrap_or(default.pedestrians),
                        crossing::MAX_PEDESTRIANS,
                    )?,
                    bicycles: self.count(
                        "bicycles",
                        typed.bicycles.unwrap_or(default.bicycles),
                        crossing::MAX_BICYCLES,
                    )?,
                }))
            }
            WorldKind::Highway => {
                self.foreign("pedestrians", typed.pedestrians, "highway")?;
                self.foreign("bicycles", typed.bicycles, "highway")?;
                let default = HighwayConfig::default();
                let lanes = typed.lanes.unwrap_or(default.lanes);
                self.number(
                    "lanes",
                    f64::from(lanes),
                    (1..=4).contains(&lanes),
                    "1 to 4 (in each direction)",
                )?;
                Ok(WorldConfig::Highway(HighwayConfig {
                    traffic: self.traffic(typed.traffic.unwrap_or(default.traffic))?,
                    parked: self.count(
                        "parked",
                        typed.parked.unwrap_or(default.parked),
                        highway::MAX_PARKED,
                    )?,
                    works: self.count("works", typed.works.unwrap_or(default.works), highway::MAX_WORKS)?,
                    lanes,
                }))
            }
        }
    }

    fn traffic(&self, share: f64) -> Result<f64, ScenarioError> {
        self.number(
            "traffic",
            share,
            (0.0..=1.0).contains(&share),
            "0 to 1 (share of the places that are taken)",
        )
    }

    fn count(&self, name: &str, count: u32, most: u32) -> Result<u32, ScenarioError> {
        if count <= most {
            Ok(count)
        } else {
            Err(self.child(name).error(count, format_args!("at most {most}")))
        }
    }

    fn foreign(&self, name: &str, value: Option<u32>, kind: &str) -> Result<(), ScenarioError> {
        value.map_or(Ok(()), |value| {
            Err(self.child(name).error(value, format_args!("no such field in a {kind}")))
        })
    }

    /// Ids are unique, and each route has room.
    fn fits_beside(&self, agent: &AgentConfig, others: &[AgentConfig]) -> Result<(), ScenarioError> {
        if others.iter().any(|other| other.id == agent.id) {
            return Err(self
                .child("id")
                .error(format_args!("\"{}\"", agent.id), "an id that no other agent has"));
        }
        let Station::Driving(route) = agent.station else { return Ok(()) };
        let n_before = others.iter().filter(|other| other.station == agent.station).count();
        if n_before < route.capacity() {
            return Ok(());
        }
        let expected = format_args!("at most {} agents on one route", route.capacity()).to_string();
        Err(self.child("route").error(format_args!("the route of {} agents", n_before + 1), expected))
    }
}
