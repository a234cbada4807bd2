//! The `[hub]` table of a scenario or settings file, and the checked settings.

use crate::engine::{EngineConfig, PublishMode};
use crate::fusion::table::{TrackingTable, WindowTable, within};
use crate::fusion::{Fusion, LateFrames, PresetKey, SettingsError, TrackingConfig};
use crate::track::Rollback;
use crate::values::{Coast, SensingDefaults};
use serde::Deserialize;
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, HubId, MapFrame};
use v2x_common::time::Span;
use v2x_common::wire::json::ReportDefaults;

/// The settings of the hub itself, as they are typed. Every field has a default; `None` is the method's default.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct HubTable {
    id: HubId,
    map_frame: Option<MapFrame>,
    delta_max_ms: f64,
    coast_ms: Option<f64>,
    method: PresetKey,
    late_data: Option<LateData>,
    only_agents: Vec<AgentId>,
    synchronous_ms: Option<f64>,
    debias_sizes: Option<bool>,
    publish: PublishTable,
    sensing: SensingDefaults,
    report_defaults: ReportDefaults,
    agents: BTreeMap<AgentId, ReportDefaults>,
}

impl HubTable {
    /// The names of the settings.
    const KEYS: &[&str] = &[
        "id",
        "map_frame",
        "delta_max_ms",
        "coast_ms",
        "method",
        "late_data",
        "only_agents",
        "synchronous_ms",
        "debias_sizes",
        "publish",
        "sensing",
        "report_defaults",
        "agents",
    ];
}

/// The policy for late data as in the file: for late frames, and for newer data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LateData {
    Replay,
    RollbackOnly,
    Drop,
    IgnoreDelay,
}

impl LateData {
    const fn meaning(self) -> (LateFrames, Rollback) {
        match self {
            Self::Replay => (LateFrames::Fuse, Rollback::Replay),
            Self::RollbackOnly => (LateFrames::Fuse, Rollback::Only),
            Self::Drop => (LateFrames::Drop, Rollback::Replay),
            Self::IgnoreDelay => (LateFrames::IgnoreDelay, Rollback::Replay),
        }
    }
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
            coast_ms: None,
            method: PresetKey::default(),
            late_data: None,
            only_agents: Vec::new(),
            synchronous_ms: None,
            debias_sizes: None,
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
    /// Time between two frames of the second list, which is a lag behind; `None` without.
    pub lagged_interval: Option<Span>,
    /// The agents that it listens to; all where there is no list.
    pub only_agents: Vec<AgentId>,
    /// Defaults where a JSON frame leaves a value out.
    pub report_defaults: ReportDefaults,
    /// The same for single agents.
    pub report_defaults_of: BTreeMap<AgentId, ReportDefaults>,
}

impl Default for HubSettings {
    fn default() -> Self {
        Self::from_table(toml::Table::new()).expect("the defaults are legal")
    }
}

impl HubSettings {
    /// The settings of a `[hub]` table.
    ///
    /// Settings of tracking have no effect under a single-frame rule, and vice versa.
    ///
    /// # Errors
    /// Names the field and its value.
    pub fn from_table(mut table: toml::Table) -> Result<Self, SettingsError> {
        let tracking: TrackingTable = read(take(&mut table, TrackingTable::KEYS))?;
        let window: WindowTable = read(take(&mut table, WindowTable::KEYS))?;
        let hub = take(&mut table, HubTable::KEYS);
        if let Some(key) = table.keys().next() {
            let known = [HubTable::KEYS, TrackingTable::KEYS, WindowTable::KEYS].concat();
            let known = known.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ");
            return Err(SettingsError::Unknown { key: key.clone(), known });
        }
        read::<HubTable>(hub)?.check(&tracking, &window)
    }

    /// Whether frames of this agent are taken.
    pub fn listens_to(&self, agent: &AgentId) -> bool {
        self.only_agents.is_empty() || self.only_agents.contains(agent)
    }

    /// Defaults of this agent's JSON frames.
    pub fn report_defaults_of(&self, agent: &AgentId) -> &ReportDefaults {
        self.report_defaults_of.get(agent).unwrap_or(&self.report_defaults)
    }
}

/// Moves the entries of these names to a table of their own.
fn take(table: &mut toml::Table, keys: &[&str]) -> toml::Table {
    keys.iter().filter_map(|key| table.remove_entry(*key)).collect()
}

fn read<T: for<'de> Deserialize<'de>>(table: toml::Table) -> Result<T, SettingsError> {
    table.try_into().map_err(|error| {
        let text = toml::de::Error::to_string(&error);
        SettingsError::Table(text.trim().replace('\n', " "))
    })
}

impl HubTable {
    fn check(self, tracking: &TrackingTable, window: &WindowTable) -> Result<HubSettings, SettingsError> {
        within("delta_max_ms", self.delta_max_ms, 1.0..=60_000.0, "1 to 60000")?;
        within("coast_ms", self.coast_ms.unwrap_or(0.0), 0.0..=60_000.0, "0 to 60000")?;
        let sensing = &self.sensing;
        within("sensing.detection_probability", sensing.detection_probability, 0.01..=1.0, "0.01 to 1")?;
        within("sensing.clutter_per_m2", sensing.clutter_per_m2, 0.0..=10.0, "0 to 10")?;
        within("sensing.births_per_m2_s", sensing.births_per_m2_s, 1e-12..=10.0, "1e-12 to 10")?;
        check_report_defaults(&self.report_defaults)?;
        self.agents.values().try_for_each(check_report_defaults)?;
        let defaults = EngineConfig::new(self.id, 0).with_preset(self.method.preset());
        let mut engine = EngineConfig {
            map_frame: self.map_frame,
            delta_max: Span::from_secs_f64(self.delta_max_ms * 1e-3),
            coast: self.coast_ms.map_or(defaults.coast, |ms| Coast::Fixed(Span::from_secs_f64(ms * 1e-3))),
            sensing: self.sensing,
            debias_sizes: self.debias_sizes.unwrap_or(defaults.debias_sizes),
            fusion: self.fusion(tracking, window)?,
            ..defaults
        };
        if let Some(late_data) = self.late_data {
            engine.late_frames = late_data.meaning().0;
        }
        if let Some(synchronous_ms) = self.synchronous_ms {
            within("synchronous_ms", synchronous_ms, 0.0..=1000.0, "0 to 1000")?;
            engine.synchronous = Span::from_secs_f64(synchronous_ms * 1e-3);
        }
        Ok(HubSettings {
            engine,
            publish: self.publish.check()?,
            lagged_interval: tracking.lagged_interval(),
            only_agents: self.only_agents,
            report_defaults: self.report_defaults,
            report_defaults_of: self.agents,
        })
    }

    /// The fusion: the method's preset, with single settings over it.
    fn fusion(&self, tracking: &TrackingTable, window: &WindowTable) -> Result<Fusion, SettingsError> {
        window.check()?;
        match self.method.preset().fusion_at(window.overlap) {
            Fusion::Window(method) => {
                // Without effect here, but a wrong value is an error all the same.
                tracking.over(TrackingConfig::default())?;
                if tracking.has_lag() {
                    return Err(SettingsError::LagWithoutMemory);
                }
                Ok(Fusion::Window(window.over(method)?))
            }
            Fusion::Tracking(method) => {
                let mut config = tracking.over(method)?;
                if let Some(late_data) = self.late_data {
                    config.tracker.rollback = late_data.meaning().1;
                }
                if let Some(synchronous_ms) = self.synchronous_ms
                    && config.tracker.synchronous > Span::ZERO
                {
                    config.tracker.synchronous = Span::from_secs_f64(synchronous_ms * 1e-3);
                }
                Ok(Fusion::Tracking(config))
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::Rule;
    use crate::fusion::{Hypotheses, PRESETS, WindowConfig};
    use crate::registration::Registration;

    fn settings(text: &str) -> Result<HubSettings, SettingsError> {
        HubSettings::from_table(text.parse().expect("valid TOML"))
    }

    fn tracking(text: &str) -> TrackingConfig {
        match settings(text).unwrap().engine.fusion {
            Fusion::Tracking(tracking) => tracking,
            Fusion::Window(_) => panic!("{text} is no tracking"),
        }
    }

    #[test]
    fn an_empty_table_is_the_default() {
        assert_eq!(settings(""), Ok(HubSettings::default()));
        assert_eq!(settings("").unwrap().engine, EngineConfig::new(HubId::new("hub").unwrap(), 0));
    }

    #[test]
    fn typed_values_take_effect() {
        let settings = settings(
            "delta_max_ms = 700\nlag_ms = 250\npublish = { mode = \"fixed\", rate_hz = 20 }\n\
             [agents.cam]\nsigma_position_m = 1.5\n",
        )
        .unwrap();
        assert_eq!(settings.engine.delta_max, Span::from_millis(700));
        assert_eq!(settings.engine.fusion.lag(), Span::from_millis(250));
        assert_eq!(settings.publish, PublishMode::Fixed { interval: Span::from_millis(50) });
        let cam = AgentId::new("cam").unwrap();
        assert_eq!(settings.report_defaults_of(&cam).sigma_position_m, 1.5);
        assert_eq!(settings.report_defaults_of(&AgentId::new("x").unwrap()).sigma_position_m, 0.5);
    }

    #[test]
    fn every_preset_is_a_method_of_the_hub() {
        for preset in PRESETS {
            let engine = settings(&format!("method = \"{}\"", preset.key)).unwrap().engine;
            assert_eq!(engine, HubSettings::default().engine.with_preset(preset), "{}", preset.key);
        }
    }

    #[test]
    fn the_number_of_association_particles_is_as_set() {
        let count = |text: &str| tracking(text).tracker.hypotheses.count();
        assert_eq!([count(""), count("association_particles = 8")], [1, 8]);
        assert_eq!(tracking("association_particles = 0").tracker.hypotheses, Hypotheses::ONE);
    }

    #[test]
    fn the_papers_methods_use_no_extension_unless_it_is_set() {
        let extras = |text: &str| {
            let tracking = tracking(text);
            [tracking.resolve_duplicates, tracking.tracker.reassociate]
        };
        assert_eq!([extras(""), extras("resolve_duplicates = false")], [[true, true], [false, true]]);
        for method in ["unikf-paper", "unikf-literal"] {
            let method = format!("method = \"{method}\"");
            assert_eq!(extras(&method), [false, false]);
            assert_eq!(extras(&format!("{method}\nreconsider = true")), [false, true]);
        }
    }

    #[test]
    fn late_data_sets_the_policy_for_late_frames_and_for_newer_data() {
        let late = |text: &str| (settings(text).unwrap().engine.late_frames, tracking(text).tracker.rollback);
        assert_eq!(late(""), (LateFrames::Fuse, Rollback::Replay));
        assert_eq!(late("method = \"unikf-literal\""), (LateFrames::Fuse, Rollback::Only));
        assert_eq!(late("late_data = \"rollback-only\""), (LateFrames::Fuse, Rollback::Only));
        assert_eq!(late("late_data = \"drop\""), (LateFrames::Drop, Rollback::Replay));
        assert_eq!(late("late_data = \"ignore-delay\""), (LateFrames::IgnoreDelay, Rollback::Replay));
    }

    #[test]
    fn epsilon_s_applies_to_the_filter_of_the_paper_only() {
        let synchronous = |text: &str| tracking(text).tracker.synchronous;
        assert_eq!(synchronous("synchronous_ms = 20"), Span::ZERO);
        assert_eq!(synchronous("synchronous_ms = 20\nmethod = \"unikf-paper\""), Span::from_millis(20));
    }

    #[test]
    fn rules_without_memory_take_their_own_settings() {
        let text = "method = \"nms\"\noverlap = 0.3\nwindow_ms = 40\nmain_agent = \"ego\"";
        let expected = WindowConfig {
            rule: Rule::Nms { overlap: 0.3 },
            window: Span::from_millis(40),
            main_agent: Some(AgentId::new("ego").unwrap()),
        };
        assert_eq!(settings(text).unwrap().engine.fusion, Fusion::Window(expected));
    }

    #[test]
    fn a_hub_can_be_limited_to_listed_agents() {
        let listens =
            |text: &str, agent: &str| settings(text).unwrap().listens_to(&AgentId::new(agent).unwrap());
        assert!(listens("", "ego") && listens("only_agents = [\"ego\"]", "ego"));
        assert!(!listens("only_agents = [\"ego\"]", "rsu"));
    }

    #[test]
    fn prior_knowledge_can_be_switched_off() {
        let priors = |text: &str| (tracking(text).tracker.class_motion, tracking(text).class_size_priors);
        assert_eq!(priors("class_priors = false"), (false, false));
        assert_eq!(priors("class_size_priors = false"), (true, false));
        assert!(!settings("debias_sizes = false").unwrap().engine.debias_sizes);
    }

    #[test]
    fn registration_is_the_methods_default_unless_it_is_set() {
        let registration = |text: &str| settings(text).unwrap().engine.fusion.registration();
        assert_eq!(registration(""), Registration::Correct);
        assert_eq!(registration("registration = \"estimate\""), Registration::Estimate);
        assert_eq!(registration("method = \"unikf-paper\""), Registration::Off);
        let both = "method = \"unikf-paper\"\nregistration = \"correct\"";
        assert_eq!(registration(both), Registration::Correct);
    }

    #[test]
    fn the_listed_keys_are_the_fields_of_the_table() {
        let error = serde_json::from_str::<HubTable>(r#"{"?": 0}"#).unwrap_err().to_string();
        let fields: Vec<&str> = error.split('`').skip(3).step_by(2).collect();
        assert_eq!(fields, HubTable::KEYS);
    }

    #[test]
    fn errors_name_the_field_and_the_value() {
        let cases = [
            ("delta_max = 5", "delta_max"),
            ("delta_max_ms = -5", "delta_max_ms is -5"),
            ("gate = nan", "gate is NaN"),
            ("method = \"wbfs\"", "unknown method `wbfs`, expected one of `ours`"),
            ("window_ms = -1", "window_ms is -1"),
            ("lag_ms = -1", "lag_ms is -1, expected 0 to 10000"),
            ("lag_ms = 10001", "lag_ms is 10001"),
            ("lag_ms = 500\nmethod = \"nms\"", "lag_ms and hub.lagged are for methods with memory"),
            ("lagged = { lag_ms = 0 }", "lagged.lag_ms is 0, expected 1 to 10000"),
            ("lagged = { rate_hz = 0 }", "lagged.rate_hz is 0, expected 0.1 to 100"),
            ("lagged = { lag = 1 }", "unknown field `lag`"),
            ("lagged = {}\nmethod = \"nms\"", "methods with memory"),
            ("lagged = {}\nassociation_particles = 8", "association_particles = 0, not 8"),
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
