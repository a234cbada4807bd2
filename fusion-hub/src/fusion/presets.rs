//! Named configurations: the methods that a hub, the tables and the sweeps share.

use super::config::{Births, Fusion, MotionModel, TrackingConfig};
use super::late::LateFrames;
use super::window::WindowConfig;
use crate::association::{AssociationConfig, AssociationCost};
use crate::baselines::{Rule, Ties, dair_v2x, infradet3d};
use crate::registration::Registration;
use crate::track::Rollback;
use crate::tracker::{Hypotheses, ParticleCount, TrackerConfig};
use crate::values::Coast;
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
    /// How it fuses; rules that go by overlap (IoU or GIoU) use this threshold.
    fusion: fn(overlap: f64) -> Fusion,
    /// How long objects coast.
    pub coast: Coast,
    /// What becomes of late frames.
    pub late_frames: LateFrames,
    /// Whether a declared law of size errors is corrected.
    pub debias_sizes: bool,
}

impl Preset {
    const fn new(key: &'static str, summary: &'static str, fusion: fn(f64) -> Fusion) -> Self {
        Self { key, summary, fusion, coast: Coast::ByRate, late_frames: LateFrames::Fuse, debias_sizes: true }
    }

    /// Without learning: objects coast for a fixed time.
    const fn unlearnt(key: &'static str, summary: &'static str, fusion: fn(f64) -> Fusion) -> Self {
        Self { coast: Coast::Fixed(Span::from_millis(1500)), ..Self::new(key, summary, fusion) }
    }

    /// How it fuses, with the paper's overlap where it uses one.
    pub fn fusion(&self) -> Fusion {
        self.fusion_at(DEFAULT_OVERLAP)
    }

    /// How it fuses; rules that use one have this threshold of overlap (IoU or GIoU).
    pub fn fusion_at(&self, overlap: f64) -> Fusion {
        (self.fusion)(overlap)
    }
}

/// All presets; the default first.
pub const PRESETS: &[Preset] = &[
    Preset::new("ours", "the best we know", |_| Fusion::default()),
    Preset::unlearnt(
        "unikf-paper",
        "UniKF as in the paper: constant velocity, CSBA, ε_s = 10 ms; late data replayed",
        |_| Fusion::Tracking(paper()),
    ),
    Preset::unlearnt(
        "unikf-literal",
        "the same as the paper's text reads: what is newer than late data is lost",
        |_| tracking(paper(), |literal| literal.tracker.rollback = Rollback::Only),
    ),
    Preset::new("single-1", "the main agent alone", |_| window(Rule::Single(0))),
    Preset::new("nms", "non-maximum suppression by IoU", |overlap| window(Rule::Nms { overlap })),
    Preset::new("nms-giou", "non-maximum suppression by GIoU", |overlap| window(Rule::NmsGiou { overlap })),
    Preset::new("psa", "promotion-suppression aggregation, ties kept", |_| window(Rule::Psa(Ties::Kept))),
    Preset::new("wbf", "weighted box fusion", |overlap| window(Rule::Wbf { overlap })),
    Preset::new("infradet3d", "InfraDet3D-Late as the paper's rows have it", |_| {
        window(Rule::InfraDet3d(infradet3d::Merge::FirstBoxMeanSize))
    }),
    Preset::new("infradet3d-code", "InfraDet3D-Late as its authors' code has it", |_| {
        window(Rule::InfraDet3d(infradet3d::Merge::MeanBoxFirstHeading))
    }),
    Preset::new("dair-v2x", "DAIR-V2X-Late as the paper's rows have it", |_| {
        window(Rule::DairV2x(dair_v2x::Variant::Average))
    }),
    Preset::new("dair-v2x-code", "DAIR-V2X-Late as its authors' code has it", |_| {
        window(Rule::DairV2x(dair_v2x::Variant::MainAgent))
    }),
    Preset::new("csba-wls", "CSBA and weighted least squares of what 100 ms hold", |_| window(Rule::CsbaWls)),
    // Variants, to show what each part is worth.
    Preset::new("ours-particles", "ours with 8 hypotheses of association", |_| {
        ours(|ours| {
            ours.tracker.hypotheses = ParticleCount::new(8).map_or(Hypotheses::ONE, Hypotheses::Particles);
        })
    }),
    Preset::new("ours-lag-0.5s", "ours, published half a second later", |_| ours(lag(500))),
    Preset::new("ours-lag-1s", "ours, published a second later", |_| ours(lag(1000))),
    Preset::new("ours-no-prior", "ours without prior knowledge of classes", |_| {
        ours(|ours| (ours.tracker.class_motion, ours.class_size_priors) = (false, false))
    }),
    Preset::new("ours-no-size-prior", "ours without sizes by class", |_| {
        ours(|ours| ours.class_size_priors = false)
    }),
    Preset::new("ours-cv", "ours with constant velocity", |_| ours(|ours| ours.motion = MotionModel::Cv)),
    Preset::new("ours-csba", "ours, associating by CSBA", |_| {
        ours(|ours| ours.tracker.association.cost = AssociationCost::Csba)
    }),
    Preset {
        debias_sizes: false,
        ..Preset::new("ours-biased", "ours without the laws of size errors", |_| Fusion::default())
    },
    Preset::new("ours-uncorrected", "ours without correction of clocks and poses", |_| {
        ours(|ours| ours.registration = Registration::Off)
    }),
    Preset::unlearnt("unikf-paper-iou", "unikf-paper, associating by overlap", |_| {
        tracking(paper(), |paper| paper.tracker.association.cost = AssociationCost::Iou)
    }),
    Preset::unlearnt("unikf-paper-euclidean", "unikf-paper, associating by distance", |_| {
        tracking(paper(), |paper| paper.tracker.association.cost = AssociationCost::Euclidean)
    }),
    // One constant-velocity filter with our association, that differs in its treatment of late data alone.
    Preset::unlearnt("replay", "constant velocity, late data replayed", |_| late_data(Rollback::Replay)),
    Preset::unlearnt("rollback-literal", "constant velocity, what is newer than late data is lost", |_| {
        late_data(Rollback::Only)
    }),
    Preset {
        late_frames: LateFrames::Drop,
        ..Preset::unlearnt("drop-late", "constant velocity, late frames dropped", |_| {
            late_data(Rollback::Replay)
        })
    },
    Preset {
        late_frames: LateFrames::IgnoreDelay,
        ..Preset::unlearnt("ignore-delay", "constant velocity, delays ignored", |_| {
            late_data(Rollback::Replay)
        })
    },
];

const fn window(rule: Rule) -> Fusion {
    Fusion::Window(WindowConfig::new(rule))
}

fn tracking(mut config: TrackingConfig, change: impl FnOnce(&mut TrackingConfig)) -> Fusion {
    change(&mut config);
    Fusion::Tracking(config)
}

fn ours(change: impl FnOnce(&mut TrackingConfig)) -> Fusion {
    tracking(TrackingConfig::default(), change)
}

const fn lag(ms: i64) -> impl FnOnce(&mut TrackingConfig) {
    move |ours| ours.tracker.hypotheses = Hypotheses::with_lag(Span::from_millis(ms))
}

fn late_data(rollback: Rollback) -> Fusion {
    ours(|ours| {
        ours.motion = MotionModel::Cv;
        ours.registration = Registration::Off;
        ours.tracker.rollback = rollback;
        ours.learning = false;
        ours.births = Births::AtOnce;
    })
}

/// The paper's tracking. It neither merges tracks nor associates a frame twice.
fn paper() -> TrackingConfig {
    let ours = TrackingConfig::default();
    TrackingConfig {
        motion: MotionModel::Cv,
        tracker: TrackerConfig {
            association: AssociationConfig::default(),
            reassociate: false,
            exclusion: false,
            synchronous: EPSILON_S,
            ..ours.tracker
        },
        resolve_duplicates: false,
        registration: Registration::Off,
        births: Births::AtOnce,
        learning: false,
        ..ours
    }
}

/// The preset of this name.
pub fn preset(key: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.key == key)
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
