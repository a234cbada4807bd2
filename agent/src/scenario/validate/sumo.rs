//! SUMO as the world of a scenario.

use std::sync::Arc;

use super::field::Field;
use super::roads;
use super::setting::Setting;
use crate::scenario::config::Sumo;
use crate::scenario::edit::WorldSource;
use crate::scenario::error::ScenarioError;
use crate::scenario::files::Files;
use crate::scenario::toml_file::TomlWorld;
use crate::trajectories::Window;
use crate::world::{Course, RecordedWorld, WorldConfig};

/// A world that SUMO drives: nothing of it is known before it is published. Its configuration may be on another machine
/// than an agent, so that it need not be there.
pub(super) fn sumo(field: &Field<'_>, file: &TomlWorld, files: &Files) -> Result<Setting, ScenarioError> {
    let source = match (&file.file, &file.traci) {
        (Some(config), None) => WorldSource::Sumo(files.path(config)),
        (None, Some(address)) if address.contains(':') => WorldSource::Traci(address.clone()),
        (None, Some(address)) => {
            return Err(field
                .child("traci")
                .error(format_args!("{address:?}"), "HOST:PORT, such as 127.0.0.1:8813"));
        }
        (Some(_), Some(_)) => return Err(field.error("with both file and traci", "one of them")),
        (None, None) => {
            let expected =
                "the path of SUMO's configuration (.sumocfg); or traci: HOST:PORT of a SUMO that is running";
            return Err(field.child("file").error("missing", expected));
        }
    };
    if let Some(begin_s) = file.begin_s {
        field.number("begin_s", begin_s, (0.0..=1e6).contains(&begin_s), "SUMO's time in s, 0 to 1e6")?;
    }
    let (traffic, numbers) = Window::new(0, Vec::new()).traffic();
    let mut roads = roads::roads(field, &file.road, (0.0, 0.0))?;
    if let (WorldSource::Sumo(config), true) = (&source, roads.is_empty()) {
        roads = Files::lanes(config).into_iter().filter_map(roads::of_lane).collect();
    }
    let world = RecordedWorld { traffic: Arc::new(traffic), course: Course::Live { numbers }, roads };
    let sumo = Sumo { source, begin_s: file.begin_s };
    Ok(Setting { config: WorldConfig::Recorded(world), files: Vec::new(), sumo: Some(sumo) })
}
