//! Where an agent of a scenario is.

use std::sync::Arc;

use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::id::MapFrame;
use v2x_common::sensor::SensorKind;
use v2x_common::time::Span;

use super::field::Field;
use crate::scenario::error::ScenarioError;
use crate::scenario::toml_file::TomlPose;
use crate::trajectories::{Sample, Trajectory};
use crate::world::{RecordedWorld, Route, Station, WorldConfig};

/// Ids that an error names.
const NAMED: usize = 12;
/// A vehicle turns from one leg to the next in twice this time, s.
const HALF_TURN_S: f64 = 1.0;

/// What all agents of a scenario have in common.
pub(super) struct Surroundings {
    pub(super) world: WorldConfig,
    pub(super) loop_length: Span,
    pub(super) map_frame: Option<MapFrame>,
}

impl Surroundings {
    /// What is subtracted from the coordinates of the scenario, m.
    fn origin(&self) -> (f64, f64) {
        self.world.recorded().map_or((0.0, 0.0), |recorded| recorded.traffic.origin)
    }
}

/// The ways to say where an agent is, of which it needs one.
pub(super) struct Placing {
    pub(super) pose: Option<TomlPose>,
    pub(super) route: Option<String>,
    pub(super) ride: Option<String>,
    pub(super) waypoints: Option<Vec<[f64; 3]>>,
}

pub(super) fn station(
    field: &Field<'_>,
    placing: Placing,
    kind: SensorKind,
    surroundings: &Surroundings,
) -> Result<Station, ScenarioError> {
    check_number(field, &placing, &surroundings.world)?;
    let Placing { pose, route, ride, waypoints } = placing;
    if let Some(pose) = pose {
        return fixed_pose(&field.child("pose"), &pose, surroundings.origin()).map(Station::Fixed);
    }
    let moving = [("route", route.is_some()), ("ride", ride.is_some()), ("waypoints", waypoints.is_some())];
    if let Some((name, _)) = moving.iter().find(|(_, is_given)| *is_given && kind != SensorKind::Vehicle) {
        return Err(field.child(name).error("given", "none: only vehicles drive"));
    }
    match (route, ride, waypoints) {
        (Some(name), ..) => driving(&field.child("route"), &name, &surroundings.world),
        (_, Some(name), _) => riding(&field.child("ride"), &name, &surroundings.world),
        (.., points) => following(&field.child("waypoints"), &points.unwrap_or_default(), surroundings),
    }
}

/// Exactly one way is given.
fn check_number(field: &Field<'_>, placing: &Placing, world: &WorldConfig) -> Result<(), ScenarioError> {
    let Placing { pose, route, ride, waypoints } = placing;
    let all = [
        ("pose", pose.is_some()),
        ("route", route.is_some()),
        ("ride", ride.is_some()),
        ("waypoints", waypoints.is_some()),
    ];
    let given: Vec<_> = all.iter().filter(|(_, is_given)| *is_given).map(|(name, _)| *name).collect();
    match given[..] {
        [_] => Ok(()),
        [] if world.recorded().is_some() => {
            Err(field.error("without pose, ride and waypoints", "one of them"))
        }
        [] => Err(field.error("without pose and route", "one of them, or waypoints")),
        _ => Err(field.error(format_args!("with both {}", given.join(" and ")), "one of them")),
    }
}

fn fixed_pose(field: &Field<'_>, file: &TomlPose, origin: (f64, f64)) -> Result<Pose, ScenarioError> {
    let limit = "-1e7 to 1e7";
    let x = field.number("x", file.x, file.x.abs() <= 1e7, limit)?;
    let y = field.number("y", file.y, file.y.abs() <= 1e7, limit)?;
    let yaw_deg = field.number("yaw_deg", file.yaw_deg, file.yaw_deg.abs() <= 360.0, "-360 to 360")?;
    Ok(Pose { x: x - origin.0, y: y - origin.1, yaw: wrap_angle(yaw_deg.to_radians()) })
}

fn driving(field: &Field<'_>, name: &str, world: &WorldConfig) -> Result<Station, ScenarioError> {
    match (Route::from_name(name), world) {
        (_, WorldConfig::Recorded(_)) => {
            Err(field
                .error(format_args!("{name:?}"), "none: with recorded traffic use ride, pose or waypoints"))
        }
        (Some(route), _) if route.is_of(world) => Ok(Station::Driving(route)),
        (_, WorldConfig::Crossing(_)) => {
            Err(field.error(format_args!("{name:?}"), "block-ne, block-nw, block-sw or block-se"))
        }
        (_, WorldConfig::Highway(_)) => {
            Err(field.error(format_args!("{name:?}"), "service-south or service-north"))
        }
    }
}

fn riding(field: &Field<'_>, name: &str, world: &WorldConfig) -> Result<Station, ScenarioError> {
    let Some(recorded) = world.recorded() else {
        let expected = "none: only recorded traffic (kind = \"trajectories\") has objects with names";
        return Err(field.error(format_args!("{name:?}"), expected));
    };
    if recorded.is_live() || recorded.object_id(name).is_some() {
        return Ok(Station::Riding(name.to_owned()));
    }
    Err(field.error(format_args!("{name:?}"), known_ids(recorded, name)))
}

/// Ids of the recording in words; those that begin like the wrong one first.
fn known_ids(recorded: &RecordedWorld, wrong: &str) -> String {
    let mut names: Vec<&str> = recorded.traffic.objects.iter().map(|object| object.name.as_str()).collect();
    let common = |name: &str| name.chars().zip(wrong.chars()).take_while(|(a, b)| a == b).count();
    names.sort_by_key(|name| std::cmp::Reverse(common(name)));
    let n = names.len();
    names.truncate(NAMED);
    let rest = n - names.len();
    let more = if rest > 0 { format!(" and {rest} more, which v2x world FILE lists") } else { String::new() };
    format!("the id of a recorded object: {}{more}", names.join(", "))
}

/// Legs of constant speed from point to point, with a turn around each; it stands before the first and after the last.
fn following(
    field: &Field<'_>,
    points: &[[f64; 3]],
    surroundings: &Surroundings,
) -> Result<Station, ScenarioError> {
    let loop_length = surroundings.loop_length;
    let loop_s = loop_length.as_secs_f64();
    if points.len() < 2 {
        return Err(field.error(format_args!("{} points", points.len()), "two or more points [t_s, x, y]"));
    }
    let mut last_s = -1.0;
    for (index, point) in points.iter().enumerate() {
        let [t_s, x, y] = *point;
        let is_valid = t_s > last_s && (0.0..=loop_s).contains(&t_s) && x.abs() <= 1e7 && y.abs() <= 1e7;
        if !is_valid {
            let expected = format_args!("[t_s, x, y] with t_s rising from 0 to at most {loop_s}").to_string();
            return Err(field.child(format_args!("[{index}]")).error(format_args!("{point:?}"), expected));
        }
        last_s = t_s;
    }
    let origin = surroundings.origin();
    let points: Vec<_> = points.iter().map(|[t_s, x, y]| [*t_s, x - origin.0, y - origin.1]).collect();
    let never = Span::from_nanos(i64::MAX);
    Ok(Station::Following(Arc::new(Trajectory::new(samples(&points, loop_s), never))))
}

fn samples(points: &[[f64; 3]], loop_s: f64) -> Vec<Sample> {
    let legs: Vec<Leg> = points.windows(2).map(|pair| Leg { from: pair[0], to: pair[1] }).collect();
    let headings = headings(&legs);
    let sample =
        |t_s: f64, x: f64, y: f64, yaw: f64| Sample { t: Span::from_secs_f64(t_s), pose: Pose { x, y, yaw } };
    let (first, last) = (points[0], points[points.len() - 1]);
    let mut samples = vec![sample(0.0, first[1], first[2], headings[0])];
    for (leg, yaw) in legs.iter().zip(&headings) {
        let turn_s = HALF_TURN_S.min((leg.to[0] - leg.from[0]) / 4.0);
        for t_s in [leg.from[0] + turn_s, leg.to[0] - turn_s] {
            let (x, y) = leg.at(t_s);
            samples.push(sample(t_s, x, y, *yaw));
        }
    }
    // Its first and last point themselves are on its way: there it does not turn.
    let last_yaw = headings[headings.len() - 1];
    samples.push(sample(first[0], first[1], first[2], headings[0]));
    samples.push(sample(last[0], last[1], last[2], last_yaw));
    samples.push(sample(loop_s, last[1], last[2], last_yaw));
    samples
}

/// From one waypoint to the next.
struct Leg {
    from: [f64; 3],
    to: [f64; 3],
}

impl Leg {
    fn at(&self, t_s: f64) -> (f64, f64) {
        let share = (t_s - self.from[0]) / (self.to[0] - self.from[0]);
        let between = |axis: usize| self.from[axis] + share * (self.to[axis] - self.from[axis]);
        (between(1), between(2))
    }

    /// `None` where it stands.
    fn heading(&self) -> Option<f64> {
        let (dx, dy) = (self.to[1] - self.from[1], self.to[2] - self.from[2]);
        (dx != 0.0 || dy != 0.0).then(|| libm::atan2(dy, dx))
    }
}

/// The heading of each leg: where it stands, that of the leg before, or of the first one that moves.
fn headings(legs: &[Leg]) -> Vec<f64> {
    let mut heading = legs.iter().find_map(Leg::heading).unwrap_or(0.0);
    let of_leg = |leg: &Leg| {
        heading = leg.heading().unwrap_or(heading);
        heading
    };
    legs.iter().map(of_leg).collect()
}
