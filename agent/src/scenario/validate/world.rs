//! The world of a scenario.

use super::field::Field;
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::{TomlWorld, WorldKind};
use crate::world::{CrossingConfig, HighwayConfig, WorldConfig};

pub(super) fn world(field: &Field<'_>, file: &TomlWorld) -> Result<WorldConfig, ScenarioError> {
    match file.kind {
        WorldKind::Crossing => crossing(field, file),
        WorldKind::Highway => highway(field, file),
    }
}

fn crossing(field: &Field<'_>, file: &TomlWorld) -> Result<WorldConfig, ScenarioError> {
    refuse_foreign(field, "lanes", file.lanes, "crossing")?;
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
    refuse_foreign(field, "pedestrians", file.pedestrians, "highway")?;
    refuse_foreign(field, "bicycles", file.bicycles, "highway")?;
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

/// A setting of the other kind of world is an error.
fn refuse_foreign(
    field: &Field<'_>,
    name: &str,
    value: Option<u32>,
    kind: &str,
) -> Result<(), ScenarioError> {
    value.map_or(Ok(()), |value| {
        Err(field.child(name).error(value, format_args!("no such field in a {kind}")))
    })
}
