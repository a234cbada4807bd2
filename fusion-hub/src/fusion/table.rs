//! The settings of tracking and of single-frame rules, as they are typed in the `[hub]` table, and what they mean.

use super::config::{Births, MotionModel, TrackingConfig};
use super::window::WindowConfig;
use crate::association::{AssociationConfig, AssociationCost, ClassRule};
use crate::baselines::Rule;
use crate::registration::Registration;
use crate::tracker::{Hypotheses, ParticleCount, TrackerConfig};
use serde::Deserialize;
use v2x_common::id::AgentId;
use v2x_common::spelling;
use v2x_common::time::Span;

/// Why settings are refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// A field is of the wrong kind.
    #[error("[hub]: {0}")]
    Table(String),
    /// There is no such field.
    #[error("[hub]: {}", unknown(.key, .known))]
    Unknown {
        /// The field.
        key: String,
        /// All fields.
        known: String,
    },
    /// A number is out of its range.
    #[error("hub.{field} is {value}, expected {expected}")]
    OutOfRange {
        /// The field, within `[hub]`.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The range.
        expected: &'static str,
    },
    /// A setting of a single agent is wrong.
    #[error("hub.agents.{agent}: {problem}")]
    Agent {
        /// The agent.
        agent: AgentId,
        /// The field, its value and what is expected.
        problem: String,
    },
    /// A lag and several hypotheses of association.
    #[error(
        "hub.lag_ms and hub.lagged are for one hypothesis: set hub.association_particles = 0, not {particles}, or no lag"
    )]
    LagOfParticles {
        /// How many hypotheses there are.
        particles: u32,
    },
    /// A lag and a method without memory.
    #[error(
        "hub.lag_ms and hub.lagged are for methods with memory (ours, unikf-paper, unikf-literal): choose one of these, or no lag"
    )]
    LagWithoutMemory,
}

/// That there is no such field, and which one is meant.
fn unknown(key: &str, known: &str) -> String {
    spelling::hinted(&format!("unknown field `{key}`, expected one of {known}"), &[])
}

/// Refuses a value out of a range.
pub(crate) fn within(
    field: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), SettingsError> {
    if range.contains(&value) { Ok(()) } else { Err(SettingsError::OutOfRange { field, value, expected }) }
}

/// Settings of tracking. What is `None` is as the method has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct TrackingTable {
    lag_ms: Option<f64>,
    lagged: Option<LaggedTable>,
    motion: Option<MotionModel>,
    association: Option<AssociationCost>,
    association_particles: Option<u32>,
    resolve_duplicates: Option<bool>,
    exclusion: Option<bool>,
    reconsider: Option<bool>,
    gate: Option<f64>,
    class_aware: Option<bool>,
    classes: Option<ClassRule>,
    class_priors: Option<bool>,
    class_size_priors: Option<bool>,
    registration: Option<Registration>,
    turned_headings: Option<bool>,
    births: Option<Births>,
    learning: Option<bool>,
    publish_existence: Option<f64>,
}

/// A second list, which is a lag behind the first one.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct LaggedTable {
    lag_ms: f64,
    rate_hz: f64,
}

impl Default for LaggedTable {
    fn default() -> Self {
        Self { lag_ms: 500.0, rate_hz: 10.0 }
    }
}

impl LaggedTable {
    fn check(&self) -> Result<(), SettingsError> {
        within("lagged.lag_ms", self.lag_ms, 1.0..=10_000.0, "1 to 10000")?;
        within("lagged.rate_hz", self.rate_hz, 0.1..=100.0, "0.1 to 100")
    }
}

impl TrackingTable {
    /// The names of the settings.
    pub(crate) const KEYS: &[&str] = &[
        "lag_ms",
        "lagged",
        "motion",
        "association",
        "association_particles",
        "resolve_duplicates",
        "exclusion",
        "reconsider",
        "gate",
        "class_aware",
        "classes",
        "class_priors",
        "class_size_priors",
        "registration",
        "turned_headings",
        "births",
        "learning",
        "publish_existence",
    ];

    /// Whether a lag is asked for.
    pub(crate) fn has_lag(&self) -> bool {
        self.lag_ms.is_some_and(|lag_ms| lag_ms > 0.0) || self.lagged.is_some()
    }

    /// Time between two frames of the second list, where there is one.
    pub(crate) fn lagged_interval(&self) -> Option<Span> {
        self.lagged.map(|lagged| Span::from_secs_f64(1.0 / lagged.rate_hz))
    }

    /// These settings over those of a method.
    pub(crate) fn over(&self, method: TrackingConfig) -> Result<TrackingConfig, SettingsError> {
        let tracker = method.tracker;
        within("lag_ms", self.lag_ms.unwrap_or(0.0), 0.0..=10_000.0, "0 to 10000")?;
        let publish_existence = self.publish_existence.unwrap_or(method.publish_existence);
        within("publish_existence", publish_existence, 0.0..=0.999, "0 to 0.999")?;
        let class_motion = self.class_priors.unwrap_or(tracker.class_motion);
        let class_sizes = self.class_size_priors.unwrap_or(method.class_size_priors);
        let AssociationConfig { cost, gate, turned_headings, classes, class_law } = tracker.association;
        let association = AssociationConfig {
            cost: self.association.unwrap_or(cost),
            gate: self.gate.unwrap_or(gate),
            turned_headings: self.turned_headings.unwrap_or(turned_headings),
            classes: self.classes.or(self.class_aware.map(exact_or_ignored)).unwrap_or(classes),
            class_law,
        };
        within("gate", association.gate, 0.1..=1e4, "0.1 to 10000")?;
        Ok(TrackingConfig {
            motion: self.motion.unwrap_or(method.motion),
            tracker: TrackerConfig {
                association,
                hypotheses: self.hypotheses(tracker.hypotheses)?,
                reassociate: self.reconsider.unwrap_or(tracker.reassociate),
                class_motion,
                exclusion: self.exclusion.unwrap_or(tracker.exclusion),
                ..tracker
            },
            resolve_duplicates: self.resolve_duplicates.unwrap_or(method.resolve_duplicates),
            class_size_priors: class_motion && class_sizes,
            registration: self.registration.unwrap_or(method.registration),
            births: self.births.unwrap_or(method.births),
            learning: self.learning.unwrap_or(method.learning),
            publish_existence,
        })
    }

    fn hypotheses(&self, method: Hypotheses) -> Result<Hypotheses, SettingsError> {
        let lag = self.lag_ms.map_or(method.lag(), |lag_ms| Span::from_secs_f64(lag_ms * 1e-3));
        self.lagged.map_or(Ok(()), |lagged| lagged.check())?;
        let second_lag = self.lagged.map(|lagged| Span::from_secs_f64(lagged.lag_ms * 1e-3));
        let second_lag = second_lag.or(method.second_lag());
        let n = self.association_particles.unwrap_or(if method.count() > 1 { method.count() } else { 0 });
        if n == 0 {
            return Ok(Hypotheses::Single { lag, second_lag });
        }
        let out_of_range = || SettingsError::OutOfRange {
            field: "association_particles",
            value: f64::from(n),
            expected: "0, or 2 to 64",
        };
        let count = ParticleCount::new(n).ok_or_else(out_of_range)?;
        if lag > Span::ZERO || second_lag.is_some() {
            return Err(SettingsError::LagOfParticles { particles: n });
        }
        Ok(Hypotheses::Particles(count))
    }
}

/// Settings of single-frame rules.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct WindowTable {
    pub(crate) overlap: f64,
    window_ms: f64,
    main_agent: Option<AgentId>,
}

impl Default for WindowTable {
    fn default() -> Self {
        let window = WindowConfig::new(Rule::CsbaWls);
        Self {
            overlap: super::presets::DEFAULT_OVERLAP,
            window_ms: window.window.as_millis_f64(),
            main_agent: window.main_agent,
        }
    }
}

impl WindowTable {
    /// The names of the settings.
    pub(crate) const KEYS: &[&str] = &["overlap", "window_ms", "main_agent"];

    /// These settings over those of a rule.
    pub(crate) fn over(&self, method: WindowConfig) -> Result<WindowConfig, SettingsError> {
        self.check()?;
        let window = Span::from_secs_f64(self.window_ms * 1e-3);
        Ok(WindowConfig { rule: method.rule, window, main_agent: self.main_agent })
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        within("overlap", self.overlap, -1.0..=1.0, "-1 to 1")?;
        within("window_ms", self.window_ms, 0.0..=60_000.0, "0 to 60000")
    }
}

/// What the older setting means.
const fn exact_or_ignored(class_aware: bool) -> ClassRule {
    if class_aware { ClassRule::Exact } else { ClassRule::Ignored }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fields of a table, from what it says of an unknown one.
    fn fields<T: for<'de> Deserialize<'de> + std::fmt::Debug>() -> Vec<String> {
        let error = serde_json::from_str::<T>(r#"{"?": 0}"#).unwrap_err().to_string();
        let names = error.split('`').skip(3).step_by(2);
        names.map(str::to_owned).collect()
    }

    #[test]
    fn the_listed_keys_are_the_fields_of_each_table() {
        assert_eq!(fields::<TrackingTable>(), TrackingTable::KEYS);
        assert_eq!(fields::<WindowTable>(), WindowTable::KEYS);
    }
}
