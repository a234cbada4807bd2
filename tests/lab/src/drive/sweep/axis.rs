//! The axis of a sweep: a parameter of the scenario, by path or by short name, and its values.

use crate::drive::sweep::method::RESERVED;
use crate::drive::sweep::overrides::{OverrideError, Path};
use std::str::FromStr;

/// A quantity with a short name.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Named {
    name: &'static str,
    label: &'static str,
    /// All these parameters are set to the value.
    paths: &'static [&'static str],
    /// These parameters are set first: without them the quantity would have no effect.
    given: &'static [(&'static str, f64)],
    values: &'static [f64],
}

const fn named(
    name: &'static str,
    label: &'static str,
    paths: &'static [&'static str],
    values: &'static [f64],
) -> Named {
    Named { name, label, paths, given: &[], values }
}

const NAMED: [Named; 10] = [
    named(
        "latency",
        "delay of the other agents, ms",
        &["agents.others.link.delay_ms"],
        &[0.0, 50.0, 100.0, 150.0, 200.0, 300.0, 400.0, 500.0, 700.0, 1000.0],
    ),
    Named {
        given: &[("agents.others.link.delay_ms", 200.0)],
        ..named(
            "jitter",
            "jitter of the other agents' delay of 200 ms (1 σ), ms",
            &["agents.others.link.jitter_ms"],
            &[0.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0],
        )
    },
    named(
        "loss",
        "lost frames of the other agents, share",
        &["agents.others.link.loss"],
        &[0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9],
    ),
    Named {
        given: &[("agents.others.link.loss", 0.3)],
        ..named(
            "burst",
            "mean length of loss bursts at 30 % loss, frames",
            &["agents.others.link.burst"],
            &[2.0, 3.0, 5.0, 8.0, 12.0, 20.0],
        )
    },
    named(
        "clock",
        "clock offset of the other agents, ms",
        &["agents.others.clock.offset_ms"],
        &[-100.0, -50.0, -20.0, -10.0, 0.0, 10.0, 20.0, 50.0, 100.0],
    ),
    Named {
        given: &[("agents.others.pose_error.correlation_s", 5.0)],
        ..named(
            "pose",
            "pose noise of the other agents (1 σ, correlated over 5 s), m and °",
            &["agents.others.pose_error.position_m", "agents.others.pose_error.yaw_deg"],
            &[0.0, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0],
        )
    },
    named(
        "bias",
        "pose bias of the other agents, m east and °",
        &["agents.others.pose_error.bias_x_m", "agents.others.pose_error.bias_yaw_deg"],
        &[0.0, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0],
    ),
    named("rate", "frames of each agent, Hz", &["agents.*.rate_hz"], &[1.0, 2.0, 5.0, 10.0, 20.0]),
    named("agents", "number of agents", &[], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]),
    named("delta-max", "Δmax, ms", &["hub.delta_max_ms"], &[50.0, 100.0, 200.0, 300.0, 500.0, 700.0, 1000.0]),
];

/// One value of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisValue {
    /// Coordinate on the axis: the number, or the place in the list for values that are no numbers.
    pub x: f64,
    /// The value as typed.
    pub text: String,
    value: toml::Value,
}

/// A swept parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its short name or path.
    pub name: String,
    /// Label with unit.
    pub label: String,
    /// Its values, in order.
    pub values: Vec<AxisValue>,
    /// Whether the values are the defaults of the short name.
    has_default_values: bool,
    paths: Vec<Path>,
    given: Vec<(Path, f64)>,
}

/// Why a text is no axis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AxisError {
    /// Neither a short name nor a path.
    #[error("{0:?} is neither one of {names} nor a path such as world.traffic", names = names().join(", "))]
    Unknown(String),
    /// A setting in which methods differ.
    #[error("hub.{0} is what methods differ in: choose --methods instead")]
    Reserved(String),
    /// A path without values.
    #[error("{0} needs values, such as {0}=0,50,100 or {0}=0:500:50")]
    NoValues(String),
    /// A value that is no number.
    #[error("{axis}: {text:?} is no {expected}")]
    BadValue {
        /// The axis.
        axis: String,
        /// The value as typed.
        text: String,
        /// What is valid.
        expected: &'static str,
    },
    /// An invalid path.
    #[error(transparent)]
    Path(#[from] OverrideError),
}

/// The short names.
pub(crate) fn names() -> Vec<&'static str> {
    NAMED.iter().map(|named| named.name).collect()
}

/// The short names with their meaning and default values.
pub(crate) fn descriptions() -> String {
    let line = |named: &Named| {
        let values: Vec<String> = named.values.iter().map(ToString::to_string).collect();
        format!("  {:<10} {}\n  {:<10} [{}]\n", named.name, named.label, "", values.join(","))
    };
    NAMED.iter().map(line).collect()
}

impl Axis {
    /// Whether it is the number of agents, which is no parameter of the scenario.
    pub fn is_number_of_agents(&self) -> bool {
        self.name == "agents"
    }

    /// Whether it is Δmax.
    pub fn is_delta_max(&self) -> bool {
        self.paths.iter().any(|path| path.to_string() == "hub.delta_max_ms")
    }

    /// Whether it is an error of clock or pose, which registration can correct.
    pub fn is_registration_error(&self) -> bool {
        let is_one =
            |path: &Path| path.to_string().contains(".clock.") || path.to_string().contains(".pose_error.");
        self.paths.iter().any(is_one)
    }

    /// Keeps `n` of the default values, from the first to the last. Typed values are not changed.
    pub fn thin_out(&mut self, n: usize) {
        if !self.has_default_values || self.values.len() <= n || n < 2 {
            return;
        }
        let last = self.values.len() - 1;
        self.values = (0..n).map(|place| self.values[place * last / (n - 1)].clone()).collect();
    }

    /// Whether both vary the same parameter.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.name == other.name || self.paths.iter().any(|path| other.paths.contains(path))
    }

    /// Sets the parameters that the axis needs.
    pub fn prepare(&self, scenario: &mut toml::Table) -> Result<(), OverrideError> {
        self.given.iter().try_for_each(|(path, given)| path.set(scenario, &toml::Value::Float(*given)))
    }

    /// Sets a value in a scenario.
    pub fn apply(&self, value: &AxisValue, scenario: &mut toml::Table) -> Result<(), OverrideError> {
        self.paths.iter().try_for_each(|path| path.set(scenario, &value.value))
    }

    fn of_numbers(name: &str) -> Option<Self> {
        let named = NAMED.iter().find(|named| named.name == name)?;
        let path = |text: &&str| text.parse::<Path>().expect("our own paths are legal");
        let number = |x: &f64| AxisValue { x: *x, text: x.to_string(), value: toml::Value::Float(*x) };
        Some(Self {
            name: name.to_owned(),
            label: named.label.to_owned(),
            values: named.values.iter().map(number).collect(),
            has_default_values: true,
            paths: named.paths.iter().map(path).collect(),
            given: named.given.iter().map(|(text, value)| (path(text), *value)).collect(),
        })
    }
}

impl FromStr for Axis {
    type Err = AxisError;

    /// `latency`, `latency=0,100,300`, `world.traffic=0.2:0.8:0.1`, `agents.car.link=ideal,lte-uu`; values that contain
    /// commas are separated by semicolons.
    fn from_str(text: &str) -> Result<Self, AxisError> {
        let (name, values) = text.split_once('=').map_or((text, None), |(name, values)| (name, Some(values)));
        let mut axis = match Self::of_numbers(name) {
            Some(axis) => axis,
            None if name.contains('.') => Self {
                name: name.to_owned(),
                label: name.to_owned(),
                values: Vec::new(),
                has_default_values: false,
                paths: vec![name.parse()?],
                given: Vec::new(),
            },
            None => return Err(AxisError::Unknown(name.to_owned())),
        };
        if let Some(reserved) = name.strip_prefix("hub.").filter(|setting| RESERVED.contains(setting)) {
            return Err(AxisError::Reserved(reserved.to_owned()));
        }
        if let Some(values) = values {
            axis.values = parse_values(&axis, values)?;
            axis.has_default_values = false;
        }
        if axis.values.is_empty() {
            return Err(AxisError::NoValues(axis.name));
        }
        Ok(axis)
    }
}

fn parse_values(axis: &Axis, text: &str) -> Result<Vec<AxisValue>, AxisError> {
    let bad = |text: &str, expected| AxisError::BadValue {
        axis: axis.name.clone(),
        text: text.to_owned(),
        expected,
    };
    if let [from, to, step] = text.split(':').collect::<Vec<_>>()[..] {
        let range = || Some((from.parse::<f64>().ok()?, to.parse::<f64>().ok()?, step.parse::<f64>().ok()?));
        if let Some((from, to, step)) = range() {
            let is_sane = step > 0.0 && to >= from && (to - from) / step <= 1000.0;
            let n = if is_sane { libm::floor((to - from) / step + 1e-9) as u32 } else { 0 };
            if !is_sane {
                return Err(bad(text, "range FROM:TO:STEP of at most 1000 steps"));
            }
            // Rounded, so that 0.1 · 3 is 0.3.
            let at = |place: u32| libm::round((from + step * f64::from(place)) * 1e9) / 1e9;
            return Ok((0..=n).map(|place| number(at(place))).collect());
        }
    }
    let must_be_a_number = !axis.name.contains('.');
    let mut values = Vec::new();
    for text in &apart(text) {
        values.push(match text.parse::<f64>() {
            Ok(x) if x.is_finite() => number(x),
            _ if must_be_a_number || text.is_empty() => return Err(bad(text, "number")),
            _ => {
                let value = text.parse::<bool>().map_or_else(|_| text.as_str().into(), toml::Value::Boolean);
                AxisValue { x: f64::NAN, text: text.clone(), value }
            }
        });
    }
    if axis.is_number_of_agents()
        && let Some(bad_one) = values.iter().find(|value| value.x != libm::trunc(value.x) || value.x < 1.0)
    {
        return Err(bad(&bad_one.text, "number of agents"));
    }
    if values.iter().any(|value| value.x.is_nan()) {
        // Names keep the typed order. Numbers among names are names.
        (0u32..).zip(&mut values).for_each(|(place, value)| value.x = f64::from(place));
    } else {
        values.sort_by(|a, b| a.x.total_cmp(&b.x));
        values.dedup_by(|a, b| a.x == b.x);
    }
    Ok(values)
}

/// Values between commas, or between semicolons. A comma inside a link's name (`lte-uu:loss=0.1,burst=4`) separates
/// nothing.
fn apart(text: &str) -> Vec<String> {
    if text.contains(';') {
        return text.split(';').map(|value| value.trim().to_owned()).collect();
    }
    let mut values: Vec<String> = Vec::new();
    for value in text.split(',').map(str::trim) {
        match values.last_mut() {
            Some(last) if value.contains('=') && !value.contains(':') && last.contains(':') => {
                *last += &format!(",{value}");
            }
            _ => values.push(value.to_owned()),
        }
    }
    values
}

fn number(x: f64) -> AxisValue {
    #[expect(clippy::cast_possible_truncation, reason = "whole, and far below 2^53")]
    let value = if x == libm::trunc(x) && x.abs() < 1e12 {
        toml::Value::Integer(x as i64)
    } else {
        toml::Value::Float(x)
    };
    AxisValue { x, text: x.to_string(), value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        text.parse::<Axis>().unwrap().values.into_iter().map(|value| value.text).collect()
    }

    #[test]
    fn values_are_those_typed_or_those_of_the_name() {
        assert_eq!(values("latency=0,100,300"), ["0", "100", "300"]);
        assert_eq!(values("world.traffic=0.1:0.5:0.2"), ["0.1", "0.3", "0.5"]);
        assert_eq!(values("agents.rsu.link=ideal,lte-uu"), ["ideal", "lte-uu"]);
        assert_eq!(values("latency").len(), 10);
        assert_eq!(values("latency=300,0,100,0"), ["0", "100", "300"]);
        assert_eq!(values("agents.car.link=ideal;cell-gamma:min=50ms,exp=150ms").len(), 2);
        assert_eq!(
            values("agents.car.link=lte-uu:loss=0.1,burst=4,ideal"),
            ["lte-uu:loss=0.1,burst=4", "ideal"]
        );
    }

    #[test]
    fn numbers_among_names_are_names() {
        let axis: Axis = "agents.car.sensing_ms=60,custom:delay=60ms".parse().unwrap();
        assert_eq!(axis.values.iter().map(|value| value.x).collect::<Vec<_>>(), [0.0, 1.0]);
    }

    #[test]
    fn default_values_are_thinned_out_and_typed_ones_are_not() {
        let thinned = |text: &str| {
            let mut axis: Axis = text.parse().unwrap();
            axis.thin_out(5);
            axis.values.iter().map(|value| value.x).collect::<Vec<_>>()
        };
        assert_eq!(thinned("latency"), [0.0, 100.0, 200.0, 400.0, 1000.0]);
        assert_eq!(thinned("latency=1,2,3,4,5,6").len(), 6);
    }

    #[test]
    fn every_short_name_sets_a_path_but_the_number_of_agents() {
        for name in names() {
            let axis: Axis = name.parse().unwrap();
            assert_eq!(axis.paths.is_empty(), axis.is_number_of_agents(), "{name}");
            assert!(!axis.values.is_empty() && !axis.label.is_empty());
        }
    }

    #[test]
    fn errors_name_the_input_and_the_valid_choices() {
        let message = |text: &str| text.parse::<Axis>().unwrap_err().to_string();
        assert!(message("latencies").contains("latency, jitter"), "{}", message("latencies"));
        assert!(message("world.traffic").contains("needs values"));
        assert!(message("latency=fast").contains("\"fast\" is no number"));
        assert!(message("latency=0:100:-5").contains("FROM:TO:STEP"));
        assert!(message("latency=").contains("\"\" is no number"));
        assert!(message("agents=1.5").contains("no number of agents"));
        assert!(message("hub.late_data=drop").contains("--methods"));
    }
}
