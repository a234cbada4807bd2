//! The runs of a sweep.

use crate::drive::sweep::axis::{Axis, AxisValue};
use crate::drive::sweep::method::SweepMethod;
use crate::drive::sweep::overrides::{OverrideError, Path};
use v2x_agent::scenario::{Files, Scenario, ScenarioError, UnknownWorld};
use v2x_common::id::AgentId;
use v2x_common::time::Span;
use v2x_fusion_hub::hub::{HubSettings, SettingsError};

/// Fused frames per second. It is no multiple of any usual rate of agents, so that frames are published at every phase
/// between two captures.
pub(crate) const PUBLISH_HZ: f64 = 10.75;

/// Duration of a run, and when scoring begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Length {
    /// How long agents capture.
    pub duration: Span,
    /// When scoring begins: all agents have reported by then, and tracks are confirmed.
    pub settle: Span,
}

/// A sweep: scenario, axes, seeds and methods.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The scenario as in the file.
    pub base: toml::Table,
    /// One or two parameters.
    pub axes: Vec<Axis>,
    /// Δmax of each curve, ms; `None` is the scenario's own.
    pub delta_max_ms: Vec<Option<f64>>,
    /// Seeds of world and noise.
    pub seeds: Vec<u64>,
    /// The compared methods.
    pub methods: Vec<SweepMethod>,
    /// Duration of a run.
    pub length: Length,
    /// Whether it runs as processes over the network.
    pub live: bool,
}

/// One point of the grid. All methods get the same frames there.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The value on each axis.
    pub values: Vec<AxisValue>,
    /// Δmax of the hub, ms.
    pub delta_max_ms: f64,
    /// Seed of world and noise.
    pub seed: u64,
    /// The scenario of the point, as TOML.
    pub text: String,
    /// The same, parsed.
    pub scenario: Scenario,
    /// Number of agents that report.
    pub n_agents: usize,
}

/// Why a point cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A world that is not known before it happens.
    #[error(transparent)]
    World(#[from] UnknownWorld),
    /// A parameter cannot be set.
    #[error(transparent)]
    Override(#[from] OverrideError),
    /// The scenario is not legal with the value.
    #[error("{at}: {cause}")]
    Scenario {
        /// The values on the axes.
        at: String,
        /// The cause.
        cause: Box<ScenarioError>,
    },
    /// The hub's settings are not legal with the value.
    #[error("{at}: {cause}")]
    Hub {
        /// The values on the axes.
        at: String,
        /// The cause.
        cause: SettingsError,
    },
    /// A scenario cannot be written as TOML.
    #[error("writing the scenario: {0}")]
    Text(#[from] toml::ser::Error),
    /// The scenario has too few agents.
    #[error("{at}: the scenario has {n} agents")]
    TooFewAgents {
        /// The values on the axes.
        at: String,
        /// Number of agents.
        n: usize,
    },
}

impl Plan {
    /// All points, by value, Δmax and seed. Every one is checked before the first is run.
    pub fn points(&self) -> Result<Vec<Point>, PlanError> {
        let mut points = Vec::new();
        // Recorded traffic is read once for all points.
        let files = Files::default();
        for values in self.places() {
            for delta_max_ms in &self.delta_max_ms {
                for seed in &self.seeds {
                    points.push(self.point((&values, *delta_max_ms), *seed, &files)?);
                }
            }
        }
        Ok(points)
    }

    /// All combinations of values.
    fn places(&self) -> Vec<Vec<AxisValue>> {
        let mut places = vec![Vec::new()];
        for axis in &self.axes {
            let with = |place: &Vec<AxisValue>| {
                let with_value = |value: &AxisValue| [place.as_slice(), std::slice::from_ref(value)].concat();
                axis.values.iter().map(with_value).collect::<Vec<_>>()
            };
            places = places.iter().flat_map(with).collect();
        }
        places
    }

    fn point(
        &self,
        (values, delta_max_ms): (&[AxisValue], Option<f64>),
        seed: u64,
        files: &Files,
    ) -> Result<Point, PlanError> {
        let at = || {
            let names =
                self.axes.iter().zip(values).map(|(axis, value)| format!("{}={}", axis.name, value.text));
            names.collect::<Vec<_>>().join(" ")
        };
        let mut table = self.base.clone();
        let path = |text: &str| text.parse::<Path>().expect("our own paths are legal");
        let publish = [("mode", toml::Value::from("fixed")), ("rate_hz", PUBLISH_HZ.into())];
        let publish: toml::Table =
            publish.map(|(name, value)| (name.to_owned(), value)).into_iter().collect();
        path("hub.publish").set(&mut table, &publish.into())?;
        self.axes.iter().try_for_each(|axis| axis.prepare(&mut table))?;
        for (axis, value) in self.axes.iter().zip(values) {
            axis.apply(value, &mut table)?;
        }
        if let Some(delta_max_ms) = delta_max_ms {
            path("hub.delta_max_ms").set(&mut table, &toml::Value::Float(delta_max_ms))?;
        }
        let text = toml::to_string(&table)?;
        let scenario = Scenario::from_toml_with(&text, files)
            .map_err(|cause| PlanError::Scenario { at: at(), cause: Box::new(cause.without_place()) })?;
        scenario.check_known("lab sweep")?;
        let n = scenario.agents.len();
        let asked = self.axes.iter().zip(values).find(|(axis, _)| axis.is_number_of_agents());
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "as many as it saturates to"
        )]
        let n_agents = asked.map_or(n, |(_, value)| value.x as usize);
        if n_agents == 0 || n_agents > n {
            return Err(PlanError::TooFewAgents { at: at(), n });
        }
        let settings = HubSettings::from_table(scenario.hub.clone());
        let settings = settings.map_err(|cause| PlanError::Hub { at: at(), cause })?;
        let delta_max_ms = settings.engine.delta_max.as_millis_f64();
        let point = Point { values: values.to_vec(), delta_max_ms, seed, text, scenario, n_agents };
        for method in &self.methods {
            HubSettings::from_table(point.hub_table(*method)).map_err(|cause| PlanError::Hub {
                at: format!("{}, method {}", at(), method.key()),
                cause,
            })?;
        }
        Ok(point)
    }
}

impl Point {
    /// Its values, for messages.
    pub fn place(&self) -> String {
        let values: Vec<&str> = self.values.iter().map(|value| value.text.as_str()).collect();
        format!("at {}, Δmax {} ms, seed {}", values.join(", "), self.delta_max_ms, self.seed)
    }

    /// The agent that all others are compared with: the first in the file.
    pub fn first_agent(&self) -> AgentId {
        self.scenario.agents[0].id()
    }

    /// The hub's settings under a method.
    pub fn hub_table(&self, method: SweepMethod) -> toml::Table {
        let mut hub = self.scenario.hub.clone();
        method.configure(&mut hub, &self.first_agent());
        hub
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(axes: &[&str]) -> Plan {
        Plan {
            base: crate::drive::sweep::scenarios::DEFAULT_SCENARIO.parse().unwrap(),
            axes: axes.iter().map(|axis| axis.parse().unwrap()).collect(),
            delta_max_ms: vec![None],
            seeds: vec![1, 2],
            methods: SweepMethod::ALL.to_vec(),
            length: Length { duration: Span::from_millis(8000), settle: Span::from_millis(2000) },
            live: false,
        }
    }

    #[test]
    fn a_grid_has_every_combination_once_for_each_seed_and_delta_max() {
        let mut plan = plan(&["latency=0,100,300", "loss=0,0.5"]);
        plan.delta_max_ms = vec![Some(300.0), Some(700.0)];
        let points = plan.points().unwrap();
        assert_eq!(points.len(), 3 * 2 * 2 * 2);
        let last = points.last().unwrap();
        assert_eq!((last.values[0].x, last.values[1].x), (300.0, 0.5));
        assert_eq!((last.delta_max_ms, last.seed), (700.0, 2));
    }

    #[test]
    fn a_value_is_set_for_the_selected_agents_only() {
        let points = plan(&["latency=0,100"]).points().unwrap();
        let (now, late) = (&points[0].scenario.agents, &points[2].scenario.agents);
        assert_eq!(now[0].sending.link, late[0].sending.link);
        assert_ne!(now[1].sending.link, late[1].sending.link);
    }

    #[test]
    fn a_default_of_one_axis_does_not_override_another_axis() {
        for axes in [["loss=0.1", "burst=2"], ["burst=2", "loss=0.1"]] {
            assert_eq!(plan(&axes).points().unwrap()[0].scenario.agents[1].sending.link.loss.rate, 0.1);
        }
        assert_eq!(plan(&["burst=2"]).points().unwrap()[0].scenario.agents[1].sending.link.loss.rate, 0.3);
    }

    #[test]
    fn invalid_values_are_errors_with_their_position_before_any_run() {
        let message = |axis: &str| plan(&[axis]).points().unwrap_err().to_string();
        assert!(message("world.trafic=1").contains("trafic"), "{}", message("world.trafic=1"));
        assert!(message("loss=0,3").starts_with("loss=3: "), "{}", message("loss=0,3"));
        assert!(message("hub.delta_max_ms=0").contains("delta_max_ms"));
        assert!(message("hub.lag_ms=200").contains("method csba-wls"), "{}", message("hub.lag_ms=200"));
        assert!(message("agents=1,90").contains("the scenario has"));
    }
}
