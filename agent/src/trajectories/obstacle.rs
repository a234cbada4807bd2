//! An obstacle of a CommonRoad scenario.

use v2x_common::detection::{MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::Pose;

use super::error::{Part, TrafficError};

/// An obstacle that is read.
pub(super) struct Obstacle {
    /// Its element's name.
    pub(super) element: String,
    pub(super) id: String,
    pub(super) kind: String,
    line: u64,
    shape: Shape,
    pub(super) states: Vec<State>,
}

/// A box in the frame of the obstacle, m.
#[derive(Default)]
struct Shape {
    /// Across and along.
    size: (Option<f64>, Option<f64>),
    /// Its middle, forward and to the left.
    middle: (f64, f64),
    /// Of the box against the obstacle, rad.
    turn: f64,
    /// Of a polygon: low and high corner, x along.
    corners: Option<((f64, f64), (f64, f64))>,
}

/// Where it is at a step; what is not a number was not read.
#[derive(Clone, Copy)]
pub(super) struct State {
    pub(super) line: u64,
    pub(super) x: f64,
    pub(super) y: f64,
    yaw: f64,
    step: Option<i64>,
    /// Whether something of it is an interval or an area.
    is_set: bool,
}

impl State {
    pub(super) const fn at_line(line: u64) -> Self {
        Self { line, x: f64::NAN, y: f64::NAN, yaw: f64::NAN, step: None, is_set: false }
    }
}

impl Obstacle {
    pub(super) fn new(element: &str, id: &str, line: u64) -> Self {
        Self {
            element: element.to_owned(),
            id: id.to_owned(),
            kind: "unknown".to_owned(),
            line,
            shape: Shape::default(),
            states: Vec::new(),
        }
    }

    /// Takes the text of an element by its path below the obstacle, or the point that ends there.
    pub(super) fn take(
        &mut self,
        path: &[&str],
        (text, line): (&str, u64),
        point: (f64, f64),
    ) -> Result<(), TrafficError> {
        let Self { element, id, kind, shape, states, .. } = self;
        let number = |is_valid: &dyn Fn(f64) -> bool, expected| {
            let value = text.parse().ok().filter(|value| is_valid(*value));
            value.ok_or_else(|| TrafficError::Value {
                line,
                part: Part::Element,
                column: format!("<{}> of {element} {id}", path.join("><")),
                value: text.to_owned(),
                expected,
            })
        };
        let length = |factor: f64| {
            let is_size = |value: f64| (MIN_SIZE_M..=MAX_SIZE_M).contains(&(factor * value));
            number(&is_size, "a length in m, up to 65").map(|value| Some(factor * value))
        };
        let finite = |expected| number(&f64::is_finite, expected);
        match path {
            ["type"] => text.clone_into(kind),
            ["shape", "rectangle", "width"] => shape.size.0 = length(1.0)?,
            ["shape", "rectangle", "length"] => shape.size.1 = length(1.0)?,
            ["shape", "rectangle", "orientation"] => shape.turn = finite("an angle in rad")?,
            ["shape", "rectangle", "center", "x"] => shape.middle.0 = finite("a coordinate in m")?,
            ["shape", "rectangle", "center", "y"] => shape.middle.1 = finite("a coordinate in m")?,
            // Of the place that states name, against the middle.
            ["shape", "rectangle", "originXShift"] => shape.middle.0 = -finite("a length in m")?,
            ["shape", "circle", "radius"] => shape.size = (length(2.0)?, length(2.0)?),
            ["shape", "polygon", "point"] => shape.add_corner(point),
            [.., state, field @ ("position" | "time" | "orientation"), inner] if is_state(state) => {
                let step =
                    matches!((*field, *inner), ("time", "exact")).then(|| number(&is_step, "a whole number"));
                let yaw =
                    matches!((*field, *inner), ("orientation", "exact")).then(|| finite("an angle in rad"));
                let (step, yaw) = (step.transpose()?, yaw.transpose()?);
                if let Some(state) = states.last_mut() {
                    state.set((field, inner), (step, yaw), point);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Whether it is at one place all the time.
    pub(super) fn is_standing(&self) -> bool {
        self.element == "staticObstacle" || (self.element == "obstacle" && self.states.len() == 1)
    }

    /// The number of a state's step.
    pub(super) fn step(&self, state: &State) -> Result<i64, TrafficError> {
        state.step.ok_or_else(|| self.missing(state, "<time><exact>"))
    }

    /// The middle of its box in a state.
    pub(super) fn middle(&self, state: &State) -> Result<Pose, TrafficError> {
        if !state.x.is_finite() || !state.y.is_finite() {
            return Err(self.missing(state, "<position><point>"));
        }
        // A heading that is missing is that of the motion, but for a box that is turned or not in the middle.
        let Shape { middle, turn, .. } = &self.shape;
        let Pose { x, y, yaw } = Pose { x: state.x, y: state.y, yaw: state.yaw };
        if *middle == (0.0, 0.0) {
            return Ok(Pose { x, y, yaw: yaw + turn });
        }
        if yaw.is_nan() {
            return Err(self.missing(state, "<orientation><exact>"));
        }
        let (x, y) = Pose { x, y, yaw }.offset(middle.0, middle.1);
        Ok(Pose { x, y, yaw: yaw + turn })
    }

    /// Width and length, m, where its shape says them.
    pub(super) const fn size(&self) -> (Option<f64>, Option<f64>) {
        self.shape.size
    }

    fn missing(&self, state: &State, what: &str) -> TrafficError {
        let Self { element, id, line, .. } = self;
        let set = if state.is_set { "; sets and intervals of states are not read" } else { "" };
        let cause = format!("a state of {element} {id} (line {line}) has no {what}{set}");
        TrafficError::Xml { line: state.line, cause }
    }
}

impl Shape {
    /// A polygon is the box around it.
    fn add_corner(&mut self, (x, y): (f64, f64)) {
        let (low, high) = self.corners.unwrap_or(((x, y), (x, y)));
        let (low, high) = ((low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y)));
        self.corners = Some((low, high));
        self.middle = (f64::midpoint(low.0, high.0), f64::midpoint(low.1, high.1));
        let size = |low: f64, high: f64| Some((high - low).clamp(MIN_SIZE_M, MAX_SIZE_M));
        self.size = (size(low.1, high.1), size(low.0, high.0));
    }
}

impl State {
    /// Takes what is within one of its elements.
    fn set(&mut self, path: (&str, &str), (step, yaw): (Option<f64>, Option<f64>), point: (f64, f64)) {
        match path {
            ("position", "point") => (self.x, self.y) = point,
            #[expect(clippy::cast_possible_truncation, reason = "checked to be a whole number")]
            ("time", "exact") => self.step = step.map(|step| step as i64),
            ("orientation", "exact") => self.yaw = yaw.unwrap_or(f64::NAN),
            _ => self.is_set = true,
        }
    }
}

fn is_state(name: &str) -> bool {
    name == "state" || name == "initialState"
}

fn is_step(value: f64) -> bool {
    (0.0..=1e9).contains(&value) && libm::trunc(value) == value
}
