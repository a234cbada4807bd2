//! CommonRoad scenarios: `<dynamicObstacle>` with states, `<staticObstacle>`, and the bounds of `<lanelet>`.
//!
//! The format is that of version 2020a (<https://commonroad.in.tum.de/documentation>); 2018b's `<obstacle>` is read, too.
//! Coordinates are in m, orientations in rad counter-clockwise from x, times are numbers of steps.

use std::collections::BTreeMap;
use std::io::BufRead;

use super::builder::{At, Builder, Kind, Row};
use super::error::{Part, TrafficError};
use super::obstacle::{Obstacle, State};
use super::options::ReadOptions;
use super::traffic::{Format, Traffic};
use super::xml::{Element, Item, Xml};
use v2x_common::detection::MAX_COORDINATE_M;
use v2x_common::geometry::Pose;

pub(super) const ROOT: &str = "commonRoad";
/// Elements that are obstacles with states.
const OBSTACLES: [&str; 3] = ["dynamicObstacle", "staticObstacle", "obstacle"];
/// Types of obstacles that no detector reports as an object.
const GROUND: [&str; 5] = ["building", "pillar", "median_strip", "roadBoundary", "constructionZone"];
/// A planning problem's start: an agent can begin there.
const PROBLEM: &str = "planningProblem";

/// Reads a scenario after its root.
pub(super) fn read(
    mut xml: Xml<impl BufRead>,
    root: &Element,
    options: &ReadOptions,
) -> Result<Traffic, TrafficError> {
    let step_s = root.number("timeStepSize", "the time between two steps in s", |s| s > 0.0 && s <= 100.0)?;
    let mut file = File::new(Builder::since(0.0, options), step_s);
    let mut text = String::new();
    let is_whole = loop {
        match xml.item()? {
            Item::Open(element) => {
                text.clear();
                file.open(&element);
            }
            Item::Text(part) => text.push_str(&part),
            Item::Close(line) => {
                file.close(text.trim(), line)?;
                text.clear();
            }
            Item::End(is_whole) => break is_whole,
        }
    };
    file.finish(is_whole)
}

/// What was read so far. Only one obstacle is held, and those that stand.
struct File<'a> {
    builder: Builder<'a>,
    step_s: f64,
    /// Names of the open elements below the root.
    path: Vec<String>,
    obstacle: Option<Obstacle>,
    standing: Vec<Obstacle>,
    lanelet: Lanelet,
    /// Of a point that is open, m.
    point: (f64, f64),
    /// The first and the last step with a row of an obstacle that moves.
    steps: Option<(i64, i64)>,
    /// Obstacles that are no objects, by their type.
    ground: BTreeMap<String, u32>,
}

/// The bounds of a lane, m.
#[derive(Default)]
struct Lanelet {
    left: Vec<(f64, f64)>,
    right: Vec<(f64, f64)>,
}

impl<'a> File<'a> {
    fn new(builder: Builder<'a>, step_s: f64) -> Self {
        Self {
            builder,
            step_s,
            path: Vec::new(),
            obstacle: None,
            standing: Vec::new(),
            lanelet: Lanelet::default(),
            point: (f64::NAN, f64::NAN),
            steps: None,
            ground: BTreeMap::new(),
        }
    }

    fn open(&mut self, element: &Element) {
        let name = element.name.as_str();
        let is_obstacle = OBSTACLES.contains(&name) || name == PROBLEM;
        if self.path.is_empty() && is_obstacle {
            let id = element.attribute("id").unwrap_or_default();
            self.obstacle = Some(Obstacle::new(name, id, element.line));
        } else if name == "point" {
            self.point = (f64::NAN, f64::NAN);
        } else if let ("state" | "initialState", Some(obstacle)) = (name, &mut self.obstacle) {
            obstacle.states.push(State::at_line(element.line));
        }
        self.path.push(name.to_owned());
    }

    /// Takes the text of an element that ends.
    fn close(&mut self, text: &str, line: u64) -> Result<(), TrafficError> {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        match path[..] {
            [.., "point", axis @ ("x" | "y")] => {
                let value = coordinate(text, axis, line)?;
                if axis == "x" { self.point.0 = value } else { self.point.1 = value }
            }
            ["lanelet", side, "point"] => {
                let bound = match side {
                    "leftBound" => Some(&mut self.lanelet.left),
                    "rightBound" => Some(&mut self.lanelet.right),
                    _ => None,
                };
                if let (Some(bound), true) = (bound, self.point.0.is_finite() && self.point.1.is_finite()) {
                    bound.push(self.point);
                }
            }
            ["lanelet"] => self.lanelet(),
            [name] if OBSTACLES.contains(&name) || name == PROBLEM => {
                if let Some(obstacle) = self.obstacle.take() {
                    self.path.pop();
                    return self.obstacle(obstacle);
                }
            }
            [_, ref inner @ ..] => {
                if let Some(obstacle) = &mut self.obstacle {
                    obstacle.take(inner, (text, line), self.point)?;
                }
            }
            [] => {}
        }
        self.path.pop();
        Ok(())
    }

    /// The area between the bounds.
    fn lanelet(&mut self) {
        let Lanelet { mut left, right } = std::mem::take(&mut self.lanelet);
        if left.len() >= 2 && right.len() >= 2 {
            left.extend(right.into_iter().rev());
            self.builder.areas.push(left);
        }
    }

    fn obstacle(&mut self, obstacle: Obstacle) -> Result<(), TrafficError> {
        if obstacle.element == PROBLEM {
            if let Some(State { x, y, .. }) = obstacle.states.first() {
                self.builder.remarks.notes.push(format!(
                    "planning problem {} begins at ({x}, {y}): an agent can begin there with  waypoints = [[0, {x}, {y}], …]",
                    obstacle.id
                ));
            }
            return Ok(());
        }
        if GROUND.contains(&obstacle.kind.as_str()) {
            *self.ground.entry(obstacle.kind).or_default() += 1;
            return Ok(());
        }
        if obstacle.is_standing() {
            self.standing.push(obstacle);
            return Ok(());
        }
        for state in &obstacle.states {
            let step = obstacle.step(state)?;
            let (first, last) = self.steps.unwrap_or((step, step));
            self.steps = Some((first.min(step), last.max(step)));
            self.add(&obstacle, state, step)?;
        }
        Ok(())
    }

    #[expect(clippy::cast_precision_loss, reason = "a number of steps is far below 2^53")]
    fn add(&mut self, obstacle: &Obstacle, state: &State, step: i64) -> Result<(), TrafficError> {
        let Pose { x, y, yaw } = obstacle.middle(state)?;
        let (w, d) = obstacle.size();
        self.builder.add(&Row {
            line: state.line,
            t_s: step as f64 * self.step_s,
            id: &obstacle.id,
            kind: Kind::Name(&obstacle.kind),
            at: At { x, y, yaw, is_front: false },
            size: (w, d),
        })
    }

    /// What stands is there in every step.
    fn finish(mut self, is_whole: bool) -> Result<Traffic, TrafficError> {
        let Some((first, last)) = self.steps else {
            let what = " of a <dynamicObstacle> with a <trajectory>".to_owned();
            return Err(TrafficError::Empty(what));
        };
        let (first, last) = self.builder.steps_within((first, last), self.step_s);
        for obstacle in std::mem::take(&mut self.standing) {
            for step in first..=last {
                if let Some(state) = obstacle.states.first() {
                    self.add(&obstacle, state, step)?;
                }
            }
        }
        for (kind, n) in &self.ground {
            let note =
                format!("{n} obstacles of type {kind} are left out: no detector reports one as an object");
            self.builder.remarks.notes.push(note);
        }
        if !is_whole {
            self.builder
                .remarks
                .warnings
                .push("the file ends in the middle; what came before is used".to_owned());
        }
        self.builder.finish(Format::CommonRoad)
    }
}

fn coordinate(text: &str, name: &str, line: u64) -> Result<f64, TrafficError> {
    let value = text.parse().ok().filter(|value: &f64| value.abs() <= MAX_COORDINATE_M);
    value.ok_or_else(|| TrafficError::Value {
        line,
        part: Part::Element,
        column: format!("<{name}>"),
        value: text.to_owned(),
        expected: "a coordinate in m",
    })
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::time::Span;

    fn state(step: u32, x: f64) -> String {
        format!(
            "<time><exact>{step}</exact></time><position><point><x>{x}</x><y>2</y></point></position>\
             <orientation><exact>0</exact></orientation>"
        )
    }

    fn scenario() -> String {
        format!(
            "<?xml version=\"1.0\"?>\n<commonRoad timeStepSize=\"0.5\" commonRoadVersion=\"2020a\">\n\
             <lanelet id=\"1\"><leftBound><point><x>0</x><y>4</y></point><point><x>9</x><y>4</y></point></leftBound>\n\
             <rightBound><point><x>0</x><y>0</y></point><point><x>9</x><y>0</y></point></rightBound></lanelet>\n\
             <staticObstacle id=\"7\"><type>parkedVehicle</type><shape><circle><radius>1</radius></circle></shape>\n\
             <initialState>{}</initialState></staticObstacle>\n\
             <staticObstacle id=\"8\"><type>building</type><shape><circle><radius>9</radius></circle></shape>\n\
             <initialState>{}</initialState></staticObstacle>\n\
             <dynamicObstacle id=\"5\"><type>car</type><shape><rectangle><length>4</length><width>2</width>\
             <originXShift>-1</originXShift></rectangle></shape>\n\
             <initialState>{}</initialState><trajectory>\n<state>{}</state>\n<state>{}</state></trajectory></dynamicObstacle>\n\
             <planningProblem id=\"1\"><initialState>{}</initialState></planningProblem>\n</commonRoad>\n",
            state(0, 30.0),
            state(0, 60.0),
            state(2, 10.0),
            state(3, 14.0),
            state(4, 18.0),
            state(0, -5.0),
        )
    }

    fn parse(text: &str) -> Result<Traffic, TrafficError> {
        read(text.as_bytes(), &ReadOptions::default())
    }

    #[test]
    fn obstacles_are_objects_and_lanes_are_areas() {
        let traffic = parse(&scenario()).unwrap();
        assert_eq!(
            (traffic.format, traffic.first_s, traffic.length),
            (Format::CommonRoad, 1.0, Span::from_millis(1000))
        );
        let names: Vec<_> = traffic.objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!(names, ["5", "7"], "a building is no object");
        let car = &traffic.objects[0];
        let state = car.trajectory.at(Span::from_millis(250)).unwrap();
        // Its middle is 1 m before the place that the states name.
        assert_eq!((car.class, car.w, car.d), (Class::Car, 2.0, 4.0));
        assert_eq!((state.pose.x, state.velocity), (13.0, (8.0, 0.0)));
        let parked = &traffic.objects[1];
        assert_eq!((parked.class, parked.w, parked.d), (Class::Car, 2.0, 2.0));
        assert_eq!(
            parked.trajectory.at(Span::from_millis(700)).unwrap().pose.x,
            30.0,
            "it stands all the time"
        );
        assert_eq!(traffic.areas, [[(0.0, 4.0), (9.0, 4.0), (9.0, 0.0), (0.0, 0.0)]]);
        let notes = traffic.remarks.notes.join("\n");
        assert!(
            notes.contains("planning problem 1 begins at (-5, 2)")
                && notes.contains("1 obstacles of type building"),
            "{notes}"
        );
    }

    #[test]
    fn what_is_wrong_in_a_scenario_is_named_with_its_line() {
        let good = scenario();
        for (from, to, expected) in [
            (
                "timeStepSize=\"0.5\"",
                "timeStepSize=\"0\"",
                "line 2, attribute timeStepSize of <commonRoad>: \"0\"",
            ),
            ("<x>14</x>", "<x>far</x>", "line 11, element <x>: \"far\", expected a coordinate in m"),
            (
                "<length>4</length>",
                "<length>-4</length>",
                "line 9, element <shape><rectangle><length> of dynamicObstacle 5",
            ),
            (
                "<time><exact>3</exact></time>",
                "<time><exact>3.5</exact></time>",
                "line 11, element <trajectory><state><time><exact>",
            ),
            (
                "<time><exact>3</exact></time>",
                "<time><intervalStart>3</intervalStart></time>",
                "sets and intervals",
            ),
            ("<exact>4</exact>", "<exact>3</exact>", "lines 11 and 12: object 5 has two rows at 1.5 s"),
            ("dynamicObstacle", "phantomObstacle", "has no rows of a <dynamicObstacle> with a <trajectory>"),
        ] {
            let message = parse(&good.replace(from, to)).unwrap_err().to_string();
            assert!(message.contains(expected), "{expected:?} is not in {message:?}");
        }
    }

    #[test]
    fn the_part_that_is_kept_counts_from_step_0() {
        let options = ReadOptions { from_s: Some(1.5), ..ReadOptions::default() };
        let traffic = read(scenario().as_bytes(), &options).unwrap();
        assert_eq!((traffic.first_s, traffic.length), (1.5, Span::from_millis(500)));
        // What stands is not tried for each of the steps that are not kept.
        let long = scenario().replace("<exact>4</exact>", "<exact>900000000</exact>");
        let options = ReadOptions { to_s: Some(1.5), ..ReadOptions::default() };
        assert_eq!(read(long.as_bytes(), &options).unwrap().length, Span::from_millis(500));
    }
}
