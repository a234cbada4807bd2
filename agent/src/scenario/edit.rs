//! A scenario's text with another world.

use crate::world::{Road, RoadKind};
use std::path::PathBuf;
use std::str::FromStr;
use toml::{Table, Value};

/// The key of the `[world]` table that stays, whatever drives its objects.
const ROADS: &str = "road";

/// A world that is named on a command line, in place of the scenario's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorldSource {
    /// SUMO with this configuration.
    Sumo(PathBuf),
    /// A SUMO that runs already, by host and port.
    Traci(String),
}

/// The text names no world.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is no world; expected sumo:CFG, such as sumo:my.sumocfg, or traci:HOST:PORT of a SUMO that is running"
)]
pub struct NoSuchWorld(String);

impl FromStr for WorldSource {
    type Err = NoSuchWorld;

    fn from_str(text: &str) -> Result<Self, NoSuchWorld> {
        match text.split_once(':') {
            Some(("sumo", config)) if !config.is_empty() => Ok(Self::Sumo(config.into())),
            Some(("traci", address)) if address.contains(':') => Ok(Self::Traci(address.to_owned())),
            _ => Err(NoSuchWorld(text.to_owned())),
        }
    }
}

impl WorldSource {
    /// Its `[world]` table; a path is made absolute.
    pub fn table(&self) -> Table {
        let (key, value) = match self {
            Self::Sumo(config) => {
                let config = std::path::absolute(config).unwrap_or_else(|_| config.clone());
                ("file", config.display().to_string())
            }
            Self::Traci(address) => ("traci", address.clone()),
        };
        Table::from_iter([("kind".to_owned(), "sumo".into()), (key.to_owned(), value.into())])
    }
}

/// Why a text cannot be given another world.
#[derive(Debug, thiserror::Error)]
pub enum EditError {
    /// The text is no TOML.
    #[error("{0}")]
    Syntax(#[from] Box<toml::de::Error>),
    /// The new text cannot be written.
    #[error("writing the scenario: {0}")]
    Write(#[from] toml::ser::Error),
}

/// The scenario with this `[world]` table. Roads stay; comments do not.
pub fn with_world(text: &str, world: Table) -> Result<String, EditError> {
    let mut scenario: Table = text.parse().map_err(Box::new)?;
    let mut new = world;
    if let Some(Value::Table(mut old)) = scenario.remove("world")
        && let Some(roads) = old.remove(ROADS)
        && !new.contains_key(ROADS)
    {
        new.insert(ROADS.to_owned(), roads);
    }
    scenario.insert("world".to_owned(), Value::Table(new));
    // The old world's.
    scenario.remove("loop_s");
    Ok(toml::to_string(&scenario)?)
}

/// An agent that rides on an object, by their names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rider {
    /// The agent.
    pub agent: String,
    /// The object.
    pub ride: String,
}

/// The scenario without the agents that ride on an object for which `is_there` does not hold, and who they are.
pub fn without_riders(
    text: &str,
    is_there: impl Fn(&str) -> bool,
) -> Result<(String, Vec<Rider>), EditError> {
    let mut scenario: Table = text.parse().map_err(Box::new)?;
    let mut gone = Vec::new();
    if let Some(Value::Array(agents)) = scenario.get_mut("agents") {
        agents.retain(|agent| {
            let key = |name| agent.get(name).and_then(Value::as_str);
            let Some(ride) = key("ride").filter(|ride| !is_there(ride)) else { return true };
            let agent = key("id").unwrap_or_default().to_owned();
            gone.push(Rider { agent, ride: ride.to_owned() });
            false
        });
    }
    Ok((toml::to_string(&scenario)?, gone))
}

/// The `[world]` table of what was recorded of such a world, in this file beside the scenario, with its roads.
pub fn recorded_world(file: &str, roads: &[Road]) -> Table {
    Table::from_iter([
        (ROADS.to_owned(), roads.iter().map(road_table).collect::<Vec<_>>().into()),
        ("kind".to_owned(), "trajectories".into()),
        ("file".to_owned(), file.into()),
        ("loop".to_owned(), false.into()),
        (
            "origin".to_owned(),
            Table::from_iter([("x".to_owned(), 0.0.into()), ("y".to_owned(), 0.0.into())]).into(),
        ),
    ])
}

fn road_table(road: &Road) -> Value {
    let point = |(x, y): &(f64, f64)| Value::from(vec![*x, *y]);
    let points = Value::from(road.points.iter().map(point).collect::<Vec<_>>());
    let kind = match road.kind {
        RoadKind::Area => return Table::from_iter([("polygon".to_owned(), points)]).into(),
        RoadKind::Surface => "surface",
        RoadKind::Marking => "marking",
        RoadKind::StopLine => "stop-line",
    };
    Table::from_iter([
        ("line".to_owned(), points),
        ("width_m".to_owned(), road.width_m.into()),
        ("kind".to_owned(), kind.into()),
    ])
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    const TEXT: &str = r#"
        name = "mine"
        [world]
        kind = "crossing"
        parked = 4
        [[agents]]
        id = "ego"
        kind = "vehicle"
        ride = "we.0"
    "#;

    fn sumo(config: &str) -> Table {
        WorldSource::Sumo(config.into()).table()
    }

    #[test]
    fn a_scenario_has_the_new_world_and_its_agents_as_before() {
        let text = with_world(TEXT, sumo("my.sumocfg")).unwrap();
        let scenario = Scenario::from_toml(&text).unwrap();
        assert!(scenario.world.is_live() && !scenario.world.repeats());
        assert_eq!(scenario.agents.len(), 1);
        let again = with_world(&text, recorded_world("world-file.csv", &[])).unwrap();
        assert!(again.contains("kind = \"trajectories\"") && again.contains("loop = false"), "{again}");
        assert!(with_world("[world", Table::new()).is_err());
    }

    #[test]
    fn a_world_is_named_with_its_configuration() {
        assert_eq!("sumo:a.sumocfg".parse(), Ok(WorldSource::Sumo("a.sumocfg".into())));
        assert_eq!("traci:localhost:8813".parse(), Ok(WorldSource::Traci("localhost:8813".to_owned())));
        for wrong in ["sumo", "sumo:", "a.sumocfg", "traci:8813"] {
            let message = wrong.parse::<WorldSource>().unwrap_err().to_string();
            assert!(message.contains("expected sumo:CFG"), "{message}");
        }
    }

    #[test]
    fn agents_that_ride_on_what_never_came_are_left_out() {
        let (text, gone) = without_riders(TEXT, |name| name == "we.0").unwrap();
        assert!(gone.is_empty() && text.contains("ride = \"we.0\""), "{text}");
        let (text, gone) = without_riders(TEXT, |_| false).unwrap();
        assert_eq!(gone, [Rider { agent: "ego".to_owned(), ride: "we.0".to_owned() }]);
        assert!(!text.contains("ego") && text.contains("parked = 4"), "{text}");
    }

    #[test]
    fn roads_stay() {
        let text = TEXT.replace(
            "kind = \"crossing\"\n        parked = 4",
            "kind = \"sumo\"\nfile = \"a\"\nroad = [{ line = [[0, 0], [9, 0]] }]",
        );
        let text = with_world(&text, sumo("b.sumocfg")).unwrap();
        assert_eq!(Scenario::from_toml(&text).unwrap().world.roads().len(), 1);
    }
}
