//! The world of a scenario.

use super::field::Field;
use super::setting::Setting;
use super::{recorded, sumo};
use crate::scenario::error::ScenarioError;
use crate::scenario::files::Files;
use crate::scenario::toml_file::{TomlWorld, WorldKind};
use crate::world::{CrossingConfig, HighwayConfig, WorldConfig};

/// The world, and what it was read from.
pub(super) fn world(field: &Field<'_>, file: &TomlWorld, files: &Files) -> Result<Setting, ScenarioError> {
    refuse_foreign(field, file)?;
    match file.kind {
        WorldKind::Crossing => crossing(field, file).map(Setting::synthetic),
        WorldKind::Highway => highway(field, file).map(Setting::synthetic),
        WorldKind::Trajectories => recorded::recorded(field, file, files),
        WorldKind::Sumo => sumo::sumo(field, file, files),
    }
}

fn crossing(field: &Field<'_>, file: &TomlWorld) -> Result<WorldConfig, ScenarioError> {
    let default = CrossingConfig::default();
    let config = CrossingConfig {
        traffic: file.traffic.unwrap_or(default.traffic),
        parked: file.parked.unwrap_or(default.parked),
        works: file.works.unwrap_or(default.works),
        pedestrians: file.pedestrians.unwrap_or(default.pedestrians),
        bicycles: file.bicycles.unwrap_or(default.bicycles),
    };
    let checked = config.validate();
    checked.map_err(|invalid| field.child(invalid.field).error(invalid.value, invalid.expected))?;
    Ok(WorldConfig::Crossing(config))
}

fn highway(field: &Field<'_>, file: &TomlWorld) -> Result<WorldConfig, ScenarioError> {
    let default = HighwayConfig::default();
    let config = HighwayConfig {
        traffic: file.traffic.unwrap_or(default.traffic),
        parked: file.parked.unwrap_or(default.parked),
        works: file.works.unwrap_or(default.works),
        lanes: file.lanes.unwrap_or(default.lanes),
    };
    let checked = config.validate();
    checked.map_err(|invalid| field.child(invalid.field).error(invalid.value, invalid.expected))?;
    Ok(WorldConfig::Highway(config))
}

/// A setting of another kind of world is an error.
fn refuse_foreign(field: &Field<'_>, file: &TomlWorld) -> Result<(), ScenarioError> {
    let kind = file.kind;
    let foreign = file.given().into_iter().find(|(_, _, kinds)| !kinds.contains(&kind));
    foreign.map_or(Ok(()), |(name, value, _)| {
        let of = match kind {
            WorldKind::Crossing => "no such field in a crossing",
            WorldKind::Highway => "no such field in a highway",
            WorldKind::Trajectories => "no such field with recorded traffic",
            WorldKind::Sumo => "no such field with SUMO",
        };
        Err(field.child(name).error(value, of))
    })
}
