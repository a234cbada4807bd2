//! The whole file.

use std::collections::BTreeMap;

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

#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(in crate::scenario) enum WorldKind {
    Crossing,
    Highway,
    Trajectories,
    Sumo,
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
    pub(in crate::scenario) file: Option<String>,
    #[serde(rename = "loop")]
    pub(in crate::scenario) repeats: Option<bool>,
    pub(in crate::scenario) from_s: Option<f64>,
    pub(in crate::scenario) to_s: Option<f64>,
    pub(in crate::scenario) max_gap_s: Option<f64>,
    pub(in crate::scenario) origin: Option<TomlOrigin>,
    pub(in crate::scenario) scene: Option<String>,
    #[serde(default)]
    pub(in crate::scenario) classes: BTreeMap<String, String>,
    pub(in crate::scenario) vtypes: Option<String>,
    pub(in crate::scenario) begin_s: Option<f64>,
    pub(in crate::scenario) traci: Option<String>,
    #[serde(default)]
    pub(in crate::scenario) road: Vec<TomlRoad>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlOrigin {
    pub(in crate::scenario) x: f64,
    pub(in crate::scenario) y: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::scenario) struct TomlRoad {
    pub(in crate::scenario) kind: Option<TomlRoadKind>,
    pub(in crate::scenario) width_m: Option<f64>,
    pub(in crate::scenario) line: Option<Vec<[f64; 2]>>,
    pub(in crate::scenario) polygon: Option<Vec<[f64; 2]>>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(in crate::scenario) enum TomlRoadKind {
    #[default]
    Surface,
    Marking,
    StopLine,
}

/// A field that is given: its name, its value for messages, and the kinds of worlds that have it.
type Given = (&'static str, String, &'static [WorldKind]);

impl TomlWorld {
    /// The fields that are given and that not every world has.
    pub(in crate::scenario) fn given(&self) -> Vec<Given> {
        const SYNTHETIC: &[WorldKind] = &[WorldKind::Crossing, WorldKind::Highway];
        const CROSSING: &[WorldKind] = &[WorldKind::Crossing];
        const HIGHWAY: &[WorldKind] = &[WorldKind::Highway];
        const RECORDED: &[WorldKind] = &[WorldKind::Trajectories];
        const SUMO: &[WorldKind] = &[WorldKind::Sumo];
        const FOREIGN: &[WorldKind] = &[WorldKind::Trajectories, WorldKind::Sumo];
        fn text<T: ToString>(value: Option<&T>) -> Option<String> {
            value.map(ToString::to_string)
        }
        fn quoted(value: Option<&String>) -> Option<String> {
            value.map(|text| format!("{text:?}"))
        }
        let table = |is_given: bool| is_given.then(|| "given".to_owned());
        let all = [
            ("traffic", text(self.traffic.as_ref()), SYNTHETIC),
            ("parked", text(self.parked.as_ref()), SYNTHETIC),
            ("works", text(self.works.as_ref()), SYNTHETIC),
            ("pedestrians", text(self.pedestrians.as_ref()), CROSSING),
            ("bicycles", text(self.bicycles.as_ref()), CROSSING),
            ("lanes", text(self.lanes.as_ref()), HIGHWAY),
            ("file", quoted(self.file.as_ref()), FOREIGN),
            ("loop", text(self.repeats.as_ref()), RECORDED),
            ("from_s", text(self.from_s.as_ref()), RECORDED),
            ("to_s", text(self.to_s.as_ref()), RECORDED),
            ("max_gap_s", text(self.max_gap_s.as_ref()), RECORDED),
            ("origin", table(self.origin.is_some()), RECORDED),
            ("scene", quoted(self.scene.as_ref()), RECORDED),
            ("classes", table(!self.classes.is_empty()), RECORDED),
            ("vtypes", quoted(self.vtypes.as_ref()), RECORDED),
            ("traci", quoted(self.traci.as_ref()), SUMO),
            ("begin_s", text(self.begin_s.as_ref()), SUMO),
            ("road", table(!self.road.is_empty()), FOREIGN),
        ];
        all.into_iter().filter_map(|(name, value, kinds)| Some((name, value?, kinds))).collect()
    }
}
