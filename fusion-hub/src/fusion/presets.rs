//! Named configurations: the methods that a hub, the tables and the sweeps share.

use super::config::{Fusion, MotionModel, TrackingConfig};
use super::window::WindowConfig;
use crate::association::AssociationConfig;
use crate::baselines::{Rule, Ties, dair_v2x, infradet3d};
use crate::registration::Registration;
use crate::track::Rollback;
use crate::tracker::TrackerConfig;
use serde::de::{Deserialize, Deserializer, Error};
use serde::{Serialize, Serializer};
use v2x_common::time::Span;

/// The overlap above which boxes are of one object, for rules that use it (paper, Table I: Noise 1 and 2).
pub const DEFAULT_OVERLAP: f64 = 0.5;
/// ε_s of the paper.
pub const EPSILON_S: Span = Span::from_millis(10);

/// A named configuration.
#[derive(Debug)]
pub struct Preset {
    /// Its name in settings, tables and on command lines.
    pub key: &'static str,
    /// What it is, in a line.
    pub summary: &'static str,
    /// The configuration; rules that go by overlap (IoU or GIoU) use this threshold.
    fusion: fn(overlap: f64) -> Fusion,
}

/// All presets; the default first.
pub const PRESETS: &[Preset] = &[
    Preset { key: "ours", summary: "the best we know", fusion: |_| Fusion::default() },
    Preset {
        key: "unikf-paper",
        summary: "UniKF as in the paper: constant velocity, CSBA, ε_s = 10 ms; late data is replayed",
        fusion: |_| Fusion::Tracking(paper(Rollback::Replay)),
    },
    Preset {
        key: "unikf-literal",
        summary: "UniKF as the paper's text reads literally: measurements newer than a late one are lost",
        fusion: |_| Fusion::Tracking(paper(Rollback::Only)),
    },
    Preset { key: "single-1", summary: "the main agent alone", fusion: |_| window(Rule::Single(0)) },
    Preset {
        key: "nms",
        summary: "non-maximum suppression by IoU",
        fusion: |overlap| window(Rule::Nms { overlap }),
    },
    Preset {
        key: "nms-giou",
        summary: "non-maximum suppression by GIoU",
        fusion: |overlap| window(Rule::NmsGiou { overlap }),
    },
    Preset {
        key: "psa",
        summary: "promotion-suppression aggregation, ties kept",
        fusion: |_| window(Rule::Psa(Ties::Kept)),
    },
    Preset { key: "wbf", summary: "weighted box fusion", fusion: |overlap| window(Rule::Wbf { overlap }) },
    Preset {
        key: "infradet3d",
        summary: "InfraDet3D-Late as the paper's rows have it",
        fusion: |_| window(Rule::InfraDet3d(infradet3d::Merge::FirstBoxMeanSize)),
    },
    Preset {
        key: "infradet3d-code",
        summary: "InfraDet3D-Late as its authors' code has it",
        fusion: |_| window(Rule::InfraDet3d(infradet3d::Merge::MeanBoxFirstHeading)),
    },
    Preset {
        key: "dair-v2x",
        summary: "DAIR-V2X-Late as the paper's rows have it",
        fusion: |_| window(Rule::DairV2x(dair_v2x::Variant::Average)),
    },
    Preset {
        key: "dair-v2x-code",
        summary: "DAIR-V2X-Late as its authors' code has it",
        fusion: |_| window(Rule::DairV2x(dair_v2x::Variant::MainAgent)),
    },
    Preset {
        key: "csba-wls",
        summary: "CSBA association and weighted least squares of what 100 ms hold",
        fusion: |_| window(Rule::CsbaWls),
    },
];

const fn window(rule: Rule) -> Fusion {
    Fusion::Window(WindowConfig::new(rule))
}

/// The paper's tracking. It neither merges tracks nor associates a frame twice.
fn paper(rollback: Rollback) -> TrackingConfig {
    let ours = TrackingConfig::default();
    TrackingConfig {
        motion: MotionModel::Cv,
        tracker: TrackerConfig {
            association: AssociationConfig::default(),
            reassociate: false,
            rollback,
            synchronous: EPSILON_S,
            ..ours.tracker
        },
        resolve_duplicates: false,
        registration: Registration::Off,
        ..ours
    }
}

/// The preset of this name.
pub fn preset(key: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.key == key)
}

impl Preset {
    /// How it fuses, with the paper's overlap where it uses one.
    pub fn fusion(&self) -> Fusion {
        self.fusion_at(DEFAULT_OVERLAP)
    }

    /// How it fuses; rules that use one have this threshold of overlap (IoU or GIoU).
    pub fn fusion_at(&self, overlap: f64) -> Fusion {
        (self.fusion)(overlap)
    }
}

/// The name of a preset, in settings.
#[derive(Clone, Copy, Debug)]
pub struct PresetKey(&'static Preset);

impl PresetKey {
    /// The preset.
    pub const fn preset(self) -> &'static Preset {
        self.0
    }
}

impl Default for PresetKey {
    fn default() -> Self {
        Self(&PRESETS[0])
    }
}

impl PartialEq for PresetKey {
    fn eq(&self, other: &Self) -> bool {
        self.0.key == other.0.key
    }
}

impl Serialize for PresetKey {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.key.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for PresetKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let key = String::deserialize(deserializer)?;
        preset(&key).map(Self).ok_or_else(|| {
            let keys: Vec<String> = PRESETS.iter().map(|preset| format!("`{}`", preset.key)).collect();
            D::Error::custom(format!("unknown method `{key}`, expected one of {}", keys.join(", ")))
        })
    }
}
