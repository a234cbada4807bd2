//! From what a scenario file says to what it means: defaults, units, limits.

mod agent;
mod field;
mod link;
mod noise;
mod pose;
mod sending;
mod world;

use v2x_common::id::MapFrame;
use v2x_common::time::Span;

use super::config::{AgentConfig, Scenario};
use super::error::{Origin, ScenarioError};
use super::toml_file::TomlScenario;
use crate::world::Station;
use agent::Surroundings;
use field::Field;

const DEFAULT_LOOP_S: f64 = 120.0;
const DEFAULT_SEED: u64 = 1;

pub(super) fn scenario(text: &str, origin: Origin) -> Result<Scenario, ScenarioError> {
    let file: TomlScenario = match toml::from_str(text) {
        Ok(file) => file,
        Err(source) => return Err(ScenarioError::Syntax { origin, cause: Box::new(source) }),
    };
    let root = Field::root(&origin);
    let loop_s = file.loop_s.unwrap_or(DEFAULT_LOOP_S);
    root.number("loop_s", loop_s, (100.0..=3600.0).contains(&loop_s), "100 to 3600")?;
    let map_frame = file.map_frame.map(|name| {
        MapFrame::new(&name).map_err(|cause| root.child("map_frame").error(format_args!("{name:?}"), cause))
    });
    let world = world::world(&root.child("world"), &file.world)?;
    if file.agents.is_empty() {
        return Err(root.child("agents").error("empty", "at least one agent"));
    }
    let surroundings = Surroundings { world, map_frame: map_frame.transpose()? };
    let mut agents: Vec<AgentConfig> = Vec::with_capacity(file.agents.len());
    for (index, agent) in file.agents.into_iter().enumerate() {
        let field = root.child(format_args!("agents[{index}]"));
        let agent = agent::agent(&field, agent, &surroundings)?;
        check_beside(&field, &agent, &agents)?;
        agents.push(agent);
    }
    Ok(Scenario {
        name: file.name,
        loop_length: Span::from_secs_f64(loop_s),
        seed: file.seed.unwrap_or(DEFAULT_SEED),
        world,
        agents,
        hub: file.hub,
    })
}

/// Ids are unique, and each route has room.
fn check_beside(field: &Field<'_>, agent: &AgentConfig, others: &[AgentConfig]) -> Result<(), ScenarioError> {
    if others.iter().any(|other| other.id() == agent.id()) {
        let id = field.child("id");
        return Err(id.error(format_args!("\"{}\"", agent.id()), "an id that no other agent has"));
    }
    let Station::Driving(route) = agent.station else { return Ok(()) };
    let n_before = others.iter().filter(|other| other.station == agent.station).count();
    if n_before < route.capacity() {
        return Ok(());
    }
    let expected = format_args!("at most {} agents on one route", route.capacity()).to_string();
    Err(field.child("route").error(format_args!("the route of {} agents", n_before + 1), expected))
}
