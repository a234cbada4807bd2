//! From what a scenario file says to what it means: defaults, units, limits.

mod agent;
mod field;
mod link;
mod noise;
mod pose;
mod recorded;
mod roads;
mod sending;
mod setting;
mod station;
mod sumo;
mod world;

use v2x_common::id::MapFrame;
use v2x_common::time::Span;

use super::config::{AgentConfig, Scenario};
use super::error::{Origin, ScenarioError};
use super::files::Files;
use super::place;
use super::toml_file::TomlScenario;
use crate::world::{Station, WorldConfig};
use field::Field;
use setting::Setting;
use station::Surroundings;

const DEFAULT_LOOP_S: f64 = 120.0;
const DEFAULT_SEED: u64 = 1;
/// A world that is driven elsewhere does not repeat itself.
const LONGEST_LIVE: Span = Span::from_millis(7 * 86_400_000);

pub(super) fn scenario(text: &str, origin: Origin, files: &Files) -> Result<Scenario, ScenarioError> {
    read(text, origin, files).map_err(|error| match error {
        ScenarioError::Value { origin, field, value, expected, .. } => ScenarioError::Value {
            place: place::line_and_column(text, &field),
            origin,
            field,
            value,
            expected,
        },
        other => other,
    })
}

fn read(text: &str, origin: Origin, files: &Files) -> Result<Scenario, ScenarioError> {
    let file: TomlScenario = match toml::from_str(text) {
        Ok(file) => file,
        Err(source) => return Err(ScenarioError::Syntax { origin, cause: Box::new(source) }),
    };
    let root = Field::root(&origin);
    let map_frame = file.map_frame.map(|name| {
        MapFrame::new(&name).map_err(|cause| root.child("map_frame").error(format_args!("{name:?}"), cause))
    });
    let Setting { config: world, files, sumo } = world::world(&root.child("world"), &file.world, files)?;
    let loop_length = loop_length(&root, file.loop_s, &world)?;
    if file.agents.is_empty() {
        return Err(root.child("agents").error("empty", "at least one agent"));
    }
    let surroundings = Surroundings { world, loop_length, map_frame: map_frame.transpose()? };
    let mut agents: Vec<AgentConfig> = Vec::with_capacity(file.agents.len());
    for (index, agent) in file.agents.into_iter().enumerate() {
        let field = root.child(format_args!("agents[{index}]"));
        let agent = agent::agent(&field, agent, &surroundings)?;
        check_beside(&field, &agent, &agents)?;
        agents.push(agent);
    }
    Ok(Scenario {
        name: file.name,
        loop_length,
        seed: file.seed.unwrap_or(DEFAULT_SEED),
        world: surroundings.world,
        agents,
        hub: file.hub,
        files,
        sumo,
    })
}

/// Recorded traffic has the length that it has.
fn loop_length(root: &Field<'_>, loop_s: Option<f64>, world: &WorldConfig) -> Result<Span, ScenarioError> {
    match (world, loop_s) {
        (WorldConfig::Recorded(recorded), None) if recorded.is_live() => Ok(LONGEST_LIVE),
        (WorldConfig::Recorded(recorded), None) => Ok(recorded.traffic.length),
        (WorldConfig::Recorded(recorded), Some(loop_s)) => {
            let expected = if recorded.is_live() {
                "none: SUMO goes on"
            } else {
                "none: recorded traffic is as long as its file, or as from_s and to_s say"
            };
            Err(root.child("loop_s").error(loop_s, expected))
        }
        (_, loop_s) => {
            let loop_s = loop_s.unwrap_or(DEFAULT_LOOP_S);
            root.number("loop_s", loop_s, (100.0..=3600.0).contains(&loop_s), "100 to 3600")?;
            Ok(Span::from_secs_f64(loop_s))
        }
    }
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
