//! The `[hub]` table of a scenario or settings file, and the checked settings.

pub use self::agents::AgentSettings;
use self::agents::{AgentTable, ForAll, says_sigma};
use self::checks::{check_report_defaults, check_sensing};
use super::tile_settings::{TileSettings, TilesTable};
use crate::engine::{EngineConfig, PublishMode};
use crate::fusion::table::{TrackingTable, WindowTable, within};
use crate::fusion::{Fusion, LateFrames, PresetKey, SettingsError, TrackingConfig};
use crate::track::Rollback;
use crate::values::{Coast, ContributorLimit, SensingDefaults};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use v2x_common::id::{AgentId, HubId, MapFrame};
use v2x_common::spelling;
use v2x_common::time::Span;
use v2x_common::wire::Writing;
use v2x_common::wire::json::ReportDefaults;

mod agents;
mod checks;

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
    contributors: ContributorLimit,
    tiles: Option<TilesTable>,
    standby: bool,
    sensing: SensingDefaults,
    report_defaults: ReportDefaults,
    agents: BTreeMap<AgentId, AgentTable>,
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
        "contributors",
        "tiles",
        "standby",
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
            contributors: ContributorLimit::All,
            tiles: None,
            standby: false,
            sensing: engine.sensing,
            report_defaults: ReportDefaults::default(),
            agents: BTreeMap::new(),
        }
    }
}

/// Settings of a hub, checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HubSettings {
    /// Of the engine; its lineage is set at the start.
    pub engine: EngineConfig,
    /// When to publish.
    pub publish: PublishMode,
    /// Time between two frames of the second list, which is a lag behind; `None` without.
    pub lagged_interval: Option<Span>,
    /// Where on the earth the map frame is; `None`: no tiles are published. Not saved: it decides nothing of what is fused.
    #[serde(skip)]
    pub tiles: Option<TileSettings>,
    /// Whether it stands by while another hub of its name publishes. Not saved, either.
    #[serde(skip)]
    pub standby: bool,
    /// The agents that it listens to; all where there is no list.
    pub only_agents: Vec<AgentId>,
    /// What is assumed of agents that have no table of their own.
    pub every_agent: AgentSettings,
    /// The same for single agents.
    pub agents: BTreeMap<AgentId, AgentSettings>,
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

    /// How single agents write their frames, for others that read them.
    pub fn writings(&self) -> BTreeMap<AgentId, Writing> {
        self.agents.iter().map(|(agent, settings)| (*agent, settings.writing())).collect()
    }

    /// What is assumed of this agent, and how it writes its frames.
    pub fn of_agent(&self, agent: &AgentId) -> &AgentSettings {
        self.agents.get(agent).unwrap_or(&self.every_agent)
    }
}

/// Moves the entries of these names to a table of their own.
fn take(table: &mut toml::Table, keys: &[&str]) -> toml::Table {
    keys.iter().filter_map(|key| table.remove_entry(*key)).collect()
}

fn read<T: for<'de> Deserialize<'de>>(table: toml::Table) -> Result<T, SettingsError> {
    table.try_into().map_err(|error| {
        let text = toml::de::Error::to_string(&error);
        SettingsError::Table(spelling::hinted(&text.trim().replace('\n', " "), &[]))
    })
}

impl HubTable {
    fn check(self, tracking: &TrackingTable, window: &WindowTable) -> Result<HubSettings, SettingsError> {
        within("delta_max_ms", self.delta_max_ms, 1.0..=60_000.0, "1 to 60000")?;
        within("coast_ms", self.coast_ms.unwrap_or(0.0), 0.0..=60_000.0, "0 to 60000")?;
        check_sensing(&self.sensing)?;
        check_report_defaults(&self.report_defaults)?;
        let defaults = EngineConfig::new(self.id, 0).with_preset(self.method.preset());
        let mut engine = EngineConfig {
            map_frame: self.map_frame,
            delta_max: Span::from_secs_f64(self.delta_max_ms * 1e-3),
            coast: self.coast_ms.map_or(defaults.coast, |ms| Coast::Fixed(Span::from_secs_f64(ms * 1e-3))),
            sensing: self.sensing,
            debias_sizes: self.debias_sizes.unwrap_or(defaults.debias_sizes),
            contributors: self.contributors,
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
        let tiles = self.tiles.map(TilesTable::check).transpose()?;
        let for_all = ForAll {
            report_defaults: &self.report_defaults,
            sensing: &self.sensing,
            plane: tiles.map(|tiles| tiles.plane),
        };
        let agents =
            self.agents.into_iter().map(|(agent, table)| Ok((agent, table.check(&agent, &for_all)?)));
        Ok(HubSettings {
            engine,
            publish: self.publish.check()?,
            lagged_interval: tracking.lagged_interval(),
            tiles,
            standby: self.standby,
            only_agents: self.only_agents,
            every_agent: AgentSettings {
                report_defaults: self.report_defaults,
                says_sigma: says_sigma(&self.report_defaults),
                ..AgentSettings::default()
            },
            agents: agents.collect::<Result<_, SettingsError>>()?,
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

#[cfg(test)]
mod tests;
