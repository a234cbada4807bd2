//! The whole file.

use serde::Deserialize;

use super::agent::TomlAgent;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlScenario {
    pub(in crate::scenario) name: String,
    pub(in crate::scenario) loop_s: Option<f64>,
    pub(in crate::scenario) seed: Option<u64>,
    pub(in crate::scenario) map_frame: Option<String>,
    pub(in crate::scenario) world: TomlWorld,
    pub(in crate::scenario) agents: Vec<TomlAgent>,
    #[serde(default)]
    pub(in crate::scenario) hub: toml::Table,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(in crate::scenario) enum WorldKind {
    Crossing,
    Highway,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlWorld {
    pub(in crate::scenario) kind: WorldKind,
    pub(in crate::scenario) traffic: Option<f64>,
    pub(in crate::scenario) parked: Option<u32>,
    pub(in crate::scenario) works: Option<u32>,
    pub(in crate::scenario) pedestrians: Option<u32>,
    pub(in crate::scenario) bicycles: Option<u32>,
    pub(in crate::scenario) lanes: Option<u32>,
}
