//! What a person writes in the `[hub]` table of a scenario or settings file, and what it means.

use crate::association::{AssociationConfig, AssociationCost};
use crate::config::{DEFAULT_OVERLAP, EngineConfig, MotionModel};
use crate::method::{Method, WindowConfig};
use crate::particles::MAX_PARTICLES;
use crate::registration::Registration;
use crate::schedule::PublishMode;
use crate::sensing::SensingDefaults;
use crate::track::LateData;
use serde::Deserialize;
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, HubId, MapFrame};
use v2x_common::time::Span;
use v2x_common::wire::json::ReportDefaults;

/// The `[hub]` table as it is typed. Every field has a default; what is `None` is as the method has it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct HubTable {
    id: HubId,
    map_frame: Option<MapFrame>,
    delta_max_ms: f64,
    coast_ms: f64,
    method: Method,
    overlap: f64,
    window_ms: f64,
    main_agent: Option<AgentId>,
    lag_ms: f64,
    motion: Option<MotionModel>,
    late_data: Option<LateData>,
    only_agents: Vec<AgentId>,
    synchronous_ms: Option<f64>,
    association: Option<AssociationCost>,
    association_particles: Option<u32>,
    resolve_duplicates: Option<bool>,
    reconsider: Option<bool>,
    gate: Option<f64>,
    class_aware: Option<bool>,
    class_priors: bool,
    class_size_priors: bool,
    debias_sizes: bool,
    registration: Option<Registration>,
    publish_existence: f64,
    publish: PublishTable,
    sensing: SensingDefaults,
    report_defaults: ReportDefaults,
    agents: BTreeMap<AgentId, ReportDefaults>,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, tag = "mode", rename_all = "kebab-case")]
enum PublishTable {
    OnUpdate {
        #[serde(default = "default_tick_hz")]
        tick_hz: f64,
        #[serde(default = "default_max_hz")]
        max_hz: f64,
    },
    Fixed {
        rate_hz: f64,
    },
}

fn default_tick_hz() -> f64 {
    10.0
}

fn default_max_hz() -> f64 {
    500.0
}

impl Default for HubTable {
    fn default() -> Self {
        let engine = EngineConfig::new(HubId::new("hub").expect("a legal name"), 0);
        Self {
            id: engine.hub,
            map_frame: engine.map_frame,
            delta_max_ms: engine.delta_max.as_millis_f64(),
            coast_ms: engine.coast.as_millis_f64(),
            method: Method::default(),
            overlap: DEFAULT_OVERLAP,
            window_ms: 100.0,
            main_agent: None,
            lag_ms: engine.lag.as_millis_f64(),
            motion: None,
            late_data: None,
            only_agents: Vec::new(),
            synchronous_ms: None,
            association: None,
            association_particles: None,
            resolve_duplicates: None,
            reconsider: None,
            gate: None,
            class_aware: None,
            class_priors: engine.class_priors,
            class_size_priors: engine.class_size_priors,
            debias_sizes: engine.debias_sizes,
            registration: None,
            publish_existence: engine.publish_existence,
            publish: PublishTable::OnUpdate { tick_hz: default_tick_hz(), max_hz: default_max_hz() },
            sensing: engine.sensing,
            report_defaults: ReportDefaults::default(),
            agents: BTreeMap::new(),
        }
    }
}

/// Settings of a hub, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct HubSettings {
    /// Of the engine; its lineage is set at the start.
    pub engine: EngineConfig,
    /// When to publish.
    pub publish: PublishMode,
    /// Whom it listens to; everybody where there is none.
    pub only_agents: Vec<AgentId>,
    /// What is assumed where a JSON frame says nothing.
    pub report_defaults: ReportDefaults,
    /// The same for single agents.
    pub report_defaults_of: BTreeMap<AgentId, ReportDefaults>,
}

/// Why a `[hub]` table cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// A field is unknown, misspelt or of the wrong kind.
    #[error("[hub]: {0}")]
    Table(String),
    /// A number is out of its range.
    #[error("hub.{field} is {value}, expected {expected}")]
    OutOfRange {
        /// The field, within `[hub]`.
        field: &'static str,
        /// What it holds.
        value: f64,
        /// What it may hold.
        expected: &'static str,
    },
    /// A lag and several hypotheses of association.
    #[error(
        "hub.lag_ms is for one hypothesis: set hub.association_particles = 0, not {particles}, or no lag"
    )]
    LagOfParticles {
        /// How many hypotheses there are.
        particles: u32,
    },
    /// A lag and a method that forgets.
    #[error(
        "hub.lag_ms is for methods with memory (ours, unikf-paper, unikf-literal): choose one of these, or no lag"
    )]
    LagWithoutMemory,
}

impl Default for HubSettings {
    fn default() -> Self {
        HubTable::default().check().expect("the defaults are legal")
    }
}

impl HubSettings {
    /// The settings of a `[hub]` table.
    pub fn from_table(table: toml::Table) -> Result<Self, SettingsError> {
        let table: HubTable = table.try_into().map_err(|error| {
            let text = toml::de::Error::to_string(&error);
            SettingsError::Table(text.trim().replace('\n', " "))
        })?;
        table.check()
    }

    /// Whether this agent is listened to.
    pub fn listens_to(&self, agent: &AgentId) -> bool {
        self.only_agents.is_empty() || self.only_agents.contains(agent)
    }

    /// What is assumed of this agent's JSON frames.
    pub fn report_defaults_of(&self, agent: &AgentId) -> &ReportDefaults {
        self.report_defaults_of.get(agent).unwrap_or(&self.report_defaults)
    }
}

impl HubTable {
    fn check(self) -> Result<HubSettings, SettingsError> {
        within("delta_max_ms", self.delta_max_ms, 1.0..=60_000.0, "1 to 60000")?;
        within("coast_ms", self.coast_ms, 0.0..=60_000.0, "0 to 60000")?;
        within("lag_ms", self.lag_ms, 0.0..=10_000.0, "0 to 10000")?;
        within("publish_existence", self.publish_existence, 0.0..=0.999, "0 to 0.999")?;
        let sensing = &self.sensing;
        within("sensing.detection_probability", sensing.detection_probability, 0.01..=1.0, "0.01 to 1")?;
        within("sensing.clutter_per_m2", sensing.clutter_per_m2, 0.0..=10.0, "0 to 10")?;
        within("sensing.births_per_m2_s", sensing.births_per_m2_s, 1e-12..=10.0, "1e-12 to 10")?;
        check_report_defaults(&self.report_defaults)?;
        self.agents.values().try_for_each(check_report_defaults)?;
        let mut engine = EngineConfig::new(self.id, 0).with_method(self.method);
        self.override_rules(&mut engine)?;
        engine.map_frame = self.map_frame;
        engine.delta_max = Span::from_secs_f64(self.delta_max_ms * 1e-3);
        engine.coast = Span::from_secs_f64(self.coast_ms * 1e-3);
        engine.lag = Span::from_secs_f64(self.lag_ms * 1e-3);
        if engine.lag > Span::ZERO && engine.association_particles > 0 {
            return Err(SettingsError::LagOfParticles { particles: engine.association_particles });
        }
        if engine.lag > Span::ZERO && engine.window.is_some() {
            return Err(SettingsError::LagWithoutMemory);
        }
        engine.class_priors = self.class_priors;
        engine.class_size_priors = self.class_size_priors;
        engine.debias_sizes = self.debias_sizes;
        engine.registration = self.registration.unwrap_or(engine.registration);
        engine.publish_existence = self.publish_existence;
        engine.sensing = self.sensing;
        Ok(HubSettings {
            engine,
            publish: self.publish.check()?,
            only_agents: self.only_agents,
            report_defaults: self.report_defaults,
            report_defaults_of: self.agents,
        })
    }
}

impl HubTable {
    /// Single rules, over those of the method.
    fn override_rules(&self, engine: &mut EngineConfig) -> Result<(), SettingsError> {
        if let Some(synchronous_ms) = self.synchronous_ms {
            within("synchronous_ms", synchronous_ms, 0.0..=1000.0, "0 to 1000")?;
            engine.synchronous = Span::from_secs_f64(synchronous_ms * 1e-3);
            if engine.filter_synchronous > Span::ZERO {
                engine.filter_synchronous = engine.synchronous;
            }
        }
        within("overlap", self.overlap, -1.0..=1.0, "-1 to 1")?;
        within("window_ms", self.window_ms, 0.0..=60_000.0, "0 to 60000")?;
        engine.window = self.method.rule(self.overlap).map(|rule| {
            let window = Span::from_secs_f64(self.window_ms * 1e-3);
            WindowConfig { rule, window, main_agent: self.main_agent }
        });
        let AssociationConfig { cost, gate, class_aware } = engine.association;
        engine.motion = self.motion.unwrap_or(engine.motion);
        engine.late_data = self.late_data.unwrap_or(engine.late_data);
        engine.association = AssociationConfig {
            cost: self.association.unwrap_or(cost),
            gate: self.gate.unwrap_or(gate),
            class_aware: self.class_aware.unwrap_or(class_aware),
        };
        within("gate", engine.association.gate, 0.1..=1e4, "0.1 to 10000")?;
        engine.resolve_duplicates = self.resolve_duplicates.unwrap_or(engine.resolve_duplicates);
        engine.reconsider = self.reconsider.unwrap_or(engine.reconsider);
        engine.association_particles = self.association_particles.unwrap_or(engine.association_particles);
        let n_particles = engine.association_particles;
        let (fewest, most) = if n_particles == 0 { (0, 0) } else { (2, MAX_PARTICLES) };
        let range = f64::from(fewest)..=f64::from(most);
        within("association_particles", f64::from(n_particles), range, "0, or 2 to 64")
    }
}

impl PublishTable {
    fn check(self) -> Result<PublishMode, SettingsError> {
        let interval = |hz: f64| Span::from_secs_f64(1.0 / hz);
        match self {
            Self::OnUpdate { tick_hz, max_hz } => {
                within("publish.tick_hz", tick_hz, 0.1..=1000.0, "0.1 to 1000")?;
                within("publish.max_hz", max_hz, tick_hz..=100_000.0, "tick_hz to 100000")?;
                Ok(PublishMode::OnUpdate { tick: interval(tick_hz), min_interval: interval(max_hz) })
            }
            Self::Fixed { rate_hz } => {
                within("publish.rate_hz", rate_hz, 0.1..=1000.0, "0.1 to 1000")?;
                Ok(PublishMode::Fixed { interval: interval(rate_hz) })
            }
        }
    }
}

fn check_report_defaults(defaults: &ReportDefaults) -> Result<(), SettingsError> {
    let ReportDefaults {
        sigma_position_m,
        sigma_yaw_rad,
        sigma_size_relative,
        sigma_typical_size_relative,
        ..
    } = *defaults;
    within("report_defaults.sigma_position_m", sigma_position_m, 1e-3..=70.0, "0.001 to 70")?;
    within("report_defaults.sigma_yaw_rad", sigma_yaw_rad, 1e-4..=7.0, "0.0001 to 7")?;
    within("report_defaults.sigma_size_relative", sigma_size_relative, 1e-3..=1.0, "0.001 to 1")?;
    let typical = sigma_typical_size_relative;
    within("report_defaults.sigma_typical_size_relative", typical, 1e-3..=1.0, "0.001 to 1")
}

fn within(
    field: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), SettingsError> {
    if range.contains(&value) { Ok(()) } else { Err(SettingsError::OutOfRange { field, value, expected }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::Rule;

    fn settings(text: &str) -> Result<HubSettings, SettingsError> {
        HubSettings::from_table(text.parse().expect("valid TOML"))
    }

    #[test]
    fn an_empty_table_is_the_default() {
        assert_eq!(settings(""), Ok(HubSettings::default()));
    }

    #[test]
    fn what_is_typed_is_what_holds() {
        let settings = settings(
            "delta_max_ms = 700\nlag_ms = 250\npublish = { mode = \"fixed\", rate_hz = 20 }\n\
             [agents.cam]\nsigma_position_m = 1.5\n",
        )
        .unwrap();
        assert_eq!(settings.engine.delta_max, Span::from_millis(700));
        assert_eq!(settings.engine.lag, Span::from_millis(250));
        assert_eq!(settings.publish, PublishMode::Fixed { interval: Span::from_millis(50) });
        let cam = AgentId::new("cam").unwrap();
        assert_eq!(settings.report_defaults_of(&cam).sigma_position_m, 1.5);
        assert_eq!(settings.report_defaults_of(&AgentId::new("x").unwrap()).sigma_position_m, 0.5);
    }

    #[test]
    fn there_are_as_many_association_particles_as_asked_for_and_none_in_the_paper() {
        let particles = |text: &str| settings(text).unwrap().engine.association_particles;
        assert_eq!([particles(""), particles("association_particles = 8")], [0, 8]);
        let paper = EngineConfig { association_particles: 8, ..HubSettings::default().engine };
        assert_eq!(paper.with_method(Method::UnikfPaper).association_particles, 0);
        assert_eq!(paper.with_method(Method::UnikfLiteral).association_particles, 0);
    }

    #[test]
    fn the_papers_rows_have_nothing_of_ours_unless_it_is_asked_for() {
        let extras = |text: &str| {
            let engine = settings(text).unwrap().engine;
            [engine.resolve_duplicates, engine.reconsider]
        };
        assert_eq!([extras(""), extras("resolve_duplicates = false")], [[true, true], [false, true]]);
        for method in ["unikf-paper", "unikf-literal"] {
            let method = format!("method = \"{method}\"");
            assert_eq!(extras(&method), [false, false]);
            assert_eq!(extras(&format!("{method}\nreconsider = true")), [false, true]);
        }
    }

    #[test]
    fn methods_without_memory_take_their_own_settings() {
        let window = |text: &str| settings(text).unwrap().engine.window;
        assert_eq!([window(""), window("method = \"unikf-paper\"")], [None, None]);
        let text = "method = \"nms\"\noverlap = 0.3\nwindow_ms = 40\nmain_agent = \"ego\"";
        let expected = WindowConfig {
            rule: Rule::Nms { overlap: 0.3 },
            window: Span::from_millis(40),
            main_agent: Some(AgentId::new("ego").unwrap()),
        };
        assert_eq!(window(text), Some(expected));
    }

    #[test]
    fn a_hub_may_listen_to_some_agents_only() {
        let listens =
            |text: &str, agent: &str| settings(text).unwrap().listens_to(&AgentId::new(agent).unwrap());
        assert!(listens("", "ego") && listens("only_agents = [\"ego\"]", "ego"));
        assert!(!listens("only_agents = [\"ego\"]", "rsu"));
    }

    #[test]
    fn what_the_engine_knows_beforehand_can_be_switched_off() {
        let engine = |text: &str| settings(text).unwrap().engine;
        assert!(!engine("class_priors = false").class_priors);
        assert!(!engine("class_size_priors = false").class_size_priors);
        assert!(!engine("debias_sizes = false").debias_sizes);
    }

    #[test]
    fn what_is_done_about_clock_and_pose_errors_is_the_methods_unless_it_is_told() {
        let registration = |text: &str| settings(text).unwrap().engine.registration;
        assert_eq!(registration(""), Registration::Correct);
        assert_eq!(registration("registration = \"estimate\""), Registration::Estimate);
        assert_eq!(registration("method = \"unikf-paper\""), Registration::Off);
        assert_eq!(
            registration("method = \"unikf-paper\"\nregistration = \"correct\""),
            Registration::Correct
        );
    }

    #[test]
    fn errors_name_the_field_and_the_value() {
        let cases = [
            ("delta_max = 5", "delta_max"),
            ("delta_max_ms = -5", "delta_max_ms is -5"),
            ("gate = nan", "gate is NaN"),
            ("method = \"wbfs\"", "unknown variant `wbfs`, expected one of `ours`"),
            ("window_ms = -1", "window_ms is -1"),
            ("lag_ms = -1", "lag_ms is -1, expected 0 to 10000"),
            ("lag_ms = 10001", "lag_ms is 10001"),
            ("lag_ms = 500\nmethod = \"nms\"", "lag_ms is for methods with memory"),
            ("lag_ms = 500\nassociation_particles = 8", "hub.association_particles = 0, not 8"),
            ("association_particles = 1", "association_particles is 1, expected 0, or 2 to 64"),
            ("association_particles = 65", "association_particles is 65"),
            ("association_particles = -8", "-8"),
            ("publish = { mode = \"sometimes\" }", "sometimes"),
            ("publish = { mode = \"fixed\", rate_hz = 0 }", "publish.rate_hz is 0"),
            ("registration = \"on\"", "unknown variant `on`, expected one of `off`"),
            ("agents.\"a/b\" = {}", "a/b"),
        ];
        for (text, named) in cases {
            let message = settings(text).unwrap_err().to_string();
            assert!(message.contains(named), "{message:?} should name {named:?}");
        }
    }
}
