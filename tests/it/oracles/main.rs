//! Tracking metrics against the reference implementations of the field. `make.py` wrote the fixtures.

mod detection;
mod errors;
mod nuscenes;
mod tracking;

use serde::Deserialize;
use std::collections::BTreeMap;
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::geometry::BevBox;
use v2x_lab::TrueBox;
use v2x_lab::tracking::{Instant, ReportedBox, Sequence};

/// Values by name; `None` where the reference has no value.
type Figures = BTreeMap<String, Option<f64>>;

#[derive(Deserialize)]
struct Fixture {
    gate_m: f64,
    categories: Vec<String>,
    groups: Vec<Group>,
}

/// Scenes that are evaluated together.
#[derive(Deserialize)]
struct Group {
    name: String,
    scenes: Vec<Vec<Rows>>,
    /// For each scene and for all of them.
    motmetrics: Vec<Figures>,
    /// For each zero distance.
    hota: BTreeMap<String, Vec<Figures>>,
    nuscenes: Nuscenes,
}

#[derive(Deserialize)]
struct Rows {
    truth: Vec<(u32, usize, f64, f64)>,
    reported: Vec<(u64, usize, f64, f64, f64)>,
}

#[derive(Deserialize)]
struct Nuscenes {
    classes: BTreeMap<String, Figures>,
    all: Figures,
}

fn fixture() -> Fixture {
    serde_json::from_str(include_str!("tracking.json")).expect("as make.py writes it")
}

impl Fixture {
    fn sequences(&self, group: &Group) -> Vec<Sequence> {
        let instants = |scene: &Vec<Rows>| scene.iter().map(|rows| self.instant(rows)).collect();
        group
            .scenes
            .iter()
            .map(|scene| Sequence::new(instants(scene)).expect("nothing is there twice"))
            .collect()
    }

    fn instant(&self, rows: &Rows) -> Instant {
        let class = |category: usize| Class::from_name(&self.categories[category]).expect("nuScenes' names");
        let bev = |x, y| BevBox { x, y, w: 1.0, d: 1.0, yaw: 0.0 };
        Instant {
            truth: rows
                .truth
                .iter()
                .map(|&(id, category, x, y)| TrueBox {
                    id: ObjectId(id),
                    class: class(category),
                    bev: bev(x, y),
                })
                .collect(),
            reported: rows
                .reported
                .iter()
                .map(|&(track, category, score, x, y)| ReportedBox {
                    track,
                    class: class(category),
                    score,
                    bev: bev(x, y),
                })
                .collect(),
        }
    }
}

/// Asserts that every value equals the reference within 1e-6 and is missing where the reference has none.
#[track_caller]
fn assert_same(what: &str, ours: &[(&str, Option<f64>)], theirs: &Figures) {
    for (name, ours) in ours {
        let theirs = theirs[*name];
        let is_same = match (ours, theirs) {
            (Some(ours), Some(theirs)) => (ours - theirs).abs() <= 1e-6,
            (None, None) => true,
            _ => false,
        };
        assert!(is_same, "{what}, {name}: {ours:?}, expected {theirs:?}");
    }
}

#[expect(clippy::cast_precision_loss, reason = "small counts")]
fn count(n: u64) -> Option<f64> {
    Some(n as f64)
}
