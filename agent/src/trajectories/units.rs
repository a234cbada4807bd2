//! Times that are no seconds, and places that are no metres.

use v2x_common::geometry::Pose;
use v2x_common::time::Span;

/// What is read as so long between two rows of an object is in another unit, where nothing moves faster than this: s and m/s.
pub(super) const LONG_STEP_S: f64 = 20.0;
const SLOW_MPS: f64 = 0.5;
/// The same of shorter steps, where something moves, m/s: in milliseconds it would move a thousand times as fast.
const STEP_S: f64 = 1.0;
const CREEPS_MPS: (f64, f64) = (5e-4, 0.1);
/// Slower motion is none in words, m/s.
const SHOWN_MPS: f64 = 5e-4;
/// Several objects in metres are not so close to each other, m; in degrees it is some kilometres.
const TOGETHER: f64 = 0.1;
/// Objects in degrees move so slowly, and within this, where they are in metres; the steps are no longer than this.
const DEGREES_PER_S: (f64, f64) = (1e-6, 2e-3);
const DEGREES_APART: f64 = 2.0;
const MOST_STEP_S: f64 = 5.0;
/// Several objects have room within this, and no recording is larger, m.
const ROOM_M: f64 = 1.0;
const LARGEST_M: f64 = 100_000.0;
/// Fewer steps show nothing.
const MIN_STEPS: usize = 10;
/// Fewer objects may stand beside each other.
const MIN_OBJECTS: usize = 2;
/// Steps that are looked at.
const MAX_STEPS: usize = 100_000;

/// How degrees become metres.
pub(super) const PROJECT: &str = "write metres, x east and y north of a place in the middle (Python: `pyproj`; or x = (longitude − λ0) · 111320 · cos φ0, y = \
     (latitude − φ0) · 111132)";

/// What shows the units of a recording, as they are read.
#[derive(Clone, Debug)]
pub(super) struct Units {
    n_objects: usize,
    /// Usual time between two rows of an object, s.
    step_s: f64,
    /// The speed above which one of twenty steps is, m/s; `None` of too few steps.
    speed_mps: Option<f64>,
    /// West, east, south and north, m.
    extent: [f64; 4],
}

impl Units {
    /// Of objects by their places in order of time.
    pub(super) fn of<'a>(
        objects: impl Iterator<Item = impl Iterator<Item = (Span, &'a Pose)>>,
        step: Span,
    ) -> Self {
        let (mut n_objects, mut speeds) = (0, Vec::new());
        let mut extent = [f64::MAX, f64::MIN, f64::MAX, f64::MIN];
        for places in objects {
            n_objects += 1;
            let mut before: Option<(Span, &Pose)> = None;
            for (t, pose) in places {
                extent = [
                    extent[0].min(pose.x),
                    extent[1].max(pose.x),
                    extent[2].min(pose.y),
                    extent[3].max(pose.y),
                ];
                if let Some((since, from)) = before.filter(|_| speeds.len() < MAX_STEPS) {
                    speeds.push(from.distance_to(pose.x, pose.y) / (t - since).as_secs_f64());
                }
                before = Some((t, pose));
            }
        }
        speeds.sort_unstable_by(f64::total_cmp);
        let speed_mps = (speeds.len() >= MIN_STEPS).then(|| speeds[speeds.len() * 19 / 20]);
        Self { n_objects, step_s: step.as_secs_f64(), speed_mps, extent }
    }

    /// What looks wrong.
    pub(super) fn warnings(&self) -> Vec<String> {
        let times = self.unit_of_time().map(|(unit, change)| {
            let speed_mps = self.speed_mps.unwrap_or(0.0);
            let moves = match speed_mps < SHOWN_MPS {
                true => "nothing moves".to_owned(),
                false => format!("nothing moves faster than {speed_mps:.3} m/s"),
            };
            format!("a row each {} s, and {moves}: t looks like {unit}; {change}", self.step_s)
        });
        times.into_iter().chain(self.degrees().or_else(|| self.scale())).collect()
    }

    /// The unit that the times seem to have, and what to change.
    fn unit_of_time(&self) -> Option<(&'static str, &'static str)> {
        let speed_mps = self.speed_mps?;
        let creeps = (CREEPS_MPS.0..CREEPS_MPS.1).contains(&speed_mps);
        let is_other =
            (self.step_s >= LONG_STEP_S && speed_mps < SLOW_MPS) || (self.step_s >= STEP_S && creeps);
        is_other.then(|| unit_of_step(self.step_s))
    }

    /// Places that are too near to each other, or too far apart, for metres.
    fn scale(&self) -> Option<String> {
        let [west, east, south, north] = self.extent;
        let spread = (east - west).max(north - south);
        let is_close = self.n_objects > MIN_OBJECTS && spread < ROOM_M;
        let guess = if is_close {
            "kilometres, or shares of a picture"
        } else {
            "millimetres, centimetres or degrees"
        };
        (is_close || spread > LARGEST_M).then(|| {
            format!(
                "everything is at x {west:.2} to {east:.2}, y {south:.2} to {north:.2}, within {spread:.2} m: are these {guess}? x and y are \
                 in metres"
            )
        })
    }

    fn degrees(&self) -> Option<String> {
        let [west, east, south, north] = self.extent;
        let within = |least: f64, most: f64, limit: f64| least >= -limit && most <= limit;
        let can_be = (within(west, east, 180.0) && within(south, north, 90.0))
            || (within(west, east, 90.0) && within(south, north, 180.0));
        let spread = (east - west).max(north - south);
        let speed_mps = self.speed_mps?;
        let is_slow = (DEGREES_PER_S.0..DEGREES_PER_S.1).contains(&speed_mps) && self.step_s <= MOST_STEP_S;
        let is_close = self.n_objects > 1 && spread < TOGETHER;
        (can_be && spread > 0.0 && (is_close || (is_slow && spread < DEGREES_APART))).then(|| {
            let [x, y] = [f64::midpoint(west, east), f64::midpoint(south, north)];
            let (which, place) = if west < -90.0 || east > 90.0 {
                ("longitudes (x) and latitudes (y)", String::new())
            } else if south < -90.0 || north > 90.0 {
                ("latitudes (x) and longitudes (y)", ". x and y are also exchanged: x is east, of the longitude".to_owned())
            } else {
                let place = format!(
                    ". By x as the longitude this is {}, {}; if that is not the place, x and y are also exchanged",
                    compass(y, ["north", "south"]),
                    compass(x, ["east", "west"])
                );
                ("longitudes and latitudes", place)
            };
            format!(
                "everything is at x {west:.5} to {east:.5}, y {south:.5} to {north:.5}, within {spread:.5} m: these look like {which} in \
                 degrees; {PROJECT}{place}"
            )
        })
    }
}

/// An angle as on a map.
fn compass(degrees: f64, [positive, negative]: [&str; 2]) -> String {
    format!("{:.2}° {}", degrees.abs(), if degrees < 0.0 { negative } else { positive })
}

/// The unit in which rows that are read as so many seconds apart are those of a sensor, and what to change.
pub(super) fn unit_of_step(step_s: f64) -> (&'static str, &'static str) {
    match step_s {
        ..2e4 => ("milliseconds", "name the column t_ms, or write seconds (t / 1000)"),
        2e4..2e7 => ("microseconds", "write seconds (t / 1000000)"),
        _ => ("nanoseconds", "write seconds (t / 1000000000)"),
    }
}
