//! Roads of a scenario with recorded traffic, for pictures.

use super::field::Field;
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::{TomlRoad, TomlRoadKind};
use crate::trajectories::Lane;
use crate::world::{Road, RoadKind};

/// Of a lane, m.
const DEFAULT_WIDTH_M: f64 = 3.5;
const DEFAULT_MARKING_M: f64 = 0.15;

pub(super) fn roads(
    field: &Field<'_>,
    file: &[TomlRoad],
    origin: (f64, f64),
) -> Result<Vec<Road>, ScenarioError> {
    let one = |(index, road): (usize, &TomlRoad)| {
        road_of(&field.child(format_args!("road[{index}]")), road, origin)
    };
    let mut roads: Vec<_> = file.iter().enumerate().map(one).collect::<Result<_, _>>()?;
    roads.sort_by_key(|road| road.kind);
    Ok(roads)
}

fn is_place(x: f64, y: f64) -> bool {
    x.abs() <= 1e7 && y.abs() <= 1e7
}

fn is_width(width_m: f64) -> bool {
    width_m > 0.0 && width_m <= 200.0
}

/// The road of a lane of SUMO; `None` where a scenario could not have it.
pub(super) fn of_lane(lane: Lane) -> Option<Road> {
    let Lane { points, width_m } = lane;
    let is_line = points.len() >= 2 && points.iter().all(|(x, y)| is_place(*x, *y));
    (is_line && is_width(width_m)).then_some(Road { kind: RoadKind::Surface, width_m, points })
}

fn road_of(field: &Field<'_>, file: &TomlRoad, origin: (f64, f64)) -> Result<Road, ScenarioError> {
    let (name, points, least) = match (&file.polygon, &file.line) {
        (Some(polygon), None) => ("polygon", polygon, 3),
        (None, Some(line)) => ("line", line, 2),
        (Some(_), Some(_)) => return Err(field.error("with both line and polygon", "one of them")),
        (None, None) => return Err(field.error("without line and polygon", "one of them")),
    };
    if points.len() < least {
        let expected = format_args!("{least} or more points [x, y]").to_string();
        return Err(field.child(name).error(format_args!("{} points", points.len()), expected));
    }
    if let Some((index, point)) = points.iter().enumerate().find(|(_, [x, y])| !is_place(*x, *y)) {
        let place = field.child(format_args!("{name}[{index}]"));
        return Err(place.error(format_args!("{point:?}"), "coordinates in m, -1e7 to 1e7"));
    }
    let points = points.iter().map(|[x, y]| (x - origin.0, y - origin.1)).collect();
    if name == "polygon" {
        for (other, is_given) in [("kind", file.kind.is_some()), ("width_m", file.width_m.is_some())] {
            if is_given {
                return Err(field.child(other).error("given", "none: only a line has one"));
            }
        }
        return Ok(Road { kind: RoadKind::Area, width_m: 0.0, points });
    }
    let (kind, default_m) = match file.kind.unwrap_or_default() {
        TomlRoadKind::Surface => (RoadKind::Surface, DEFAULT_WIDTH_M),
        TomlRoadKind::Marking => (RoadKind::Marking, DEFAULT_MARKING_M),
        TomlRoadKind::StopLine => (RoadKind::StopLine, 0.5),
    };
    let width_m = file.width_m.unwrap_or(default_m);
    field.number("width_m", width_m, is_width(width_m), "more than 0, at most 200")?;
    Ok(Road { kind, width_m, points })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_that_no_scenario_can_have_are_left_out() {
        let lane = |points: &[(f64, f64)], width_m| of_lane(Lane { points: points.to_vec(), width_m });
        let two = [(0.0, 0.0), (1.0, 0.0)];
        assert!(lane(&two, 3.2).is_some());
        assert!(lane(&two[..1], 3.2).is_none() && lane(&[(0.0, 0.0), (2e7, 0.0)], 3.2).is_none());
        for width_m in [0.0, -1.0, f64::NAN, 201.0] {
            assert!(lane(&two, width_m).is_none(), "{width_m}");
        }
    }
}
