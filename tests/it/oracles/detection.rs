//! Detection metrics against nuscenes-devkit, and AP at overlaps against OpenCOOD's evaluation over shapely's polygons.
//! `make_detection.py` wrote the fixture.

use serde::Deserialize;
use std::collections::BTreeMap;
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::geometry::BevBox;
use v2x_lab::TrueBox;
use v2x_lab::detection::nuscenes::DetectionFigures;
use v2x_lab::detection::overlap::average_precisions;
use v2x_lab::detection::{Scene, Velocities};
use v2x_lab::tracking::{Instant, ReportedBox, Sequence};

#[derive(Deserialize)]
struct Fixture {
    categories: Vec<String>,
    groups: Vec<Group>,
}

/// Scenes that are evaluated together.
#[derive(Deserialize)]
struct Group {
    name: String,
    scenes: Vec<Vec<Rows>>,
    nuscenes: BTreeMap<String, ClassFigures>,
    overlap: [f64; 3],
}

#[derive(Deserialize)]
struct ClassFigures {
    ap: [f64; 4],
    errors: [Option<f64>; 4],
}

type Velocity = Option<[f64; 2]>;

/// Category, position, width, depth, heading and velocity.
type TrueRow = (usize, f64, f64, f64, f64, f64, Velocity);
/// The same with the score.
type ReportedRow = (usize, f64, f64, f64, f64, f64, Velocity, f64);

#[derive(Deserialize)]
struct Rows {
    truth: Vec<TrueRow>,
    reported: Vec<ReportedRow>,
}

impl Fixture {
    fn scene(&self, rows: &[Rows]) -> (Sequence, Vec<Velocities>) {
        let class = |category: usize| Class::from_name(&self.categories[category]).expect("nuScenes' names");
        let instants = rows.iter().map(|rows| Instant {
            truth: (0..)
                .zip(&rows.truth)
                .map(|(id, &(category, x, y, w, d, yaw, _))| TrueBox {
                    id: ObjectId(id),
                    class: class(category),
                    bev: BevBox { x, y, w, d, yaw },
                })
                .collect(),
            reported: (0..)
                .zip(&rows.reported)
                .map(|(track, &(category, x, y, w, d, yaw, _, score))| ReportedBox {
                    track,
                    class: class(category),
                    score,
                    bev: BevBox { x, y, w, d, yaw },
                })
                .collect(),
        });
        let velocities = rows.iter().map(|rows| Velocities {
            truth: rows.truth.iter().map(|row| row.6).collect(),
            reported: rows.reported.iter().map(|row| row.6).collect(),
        });
        (Sequence::new(instants.collect()).expect("nothing is there twice"), velocities.collect())
    }
}

/// Calls `check` with each group and its scenes.
fn each_group(check: impl Fn(&Group, &[Scene<'_>])) {
    let fixture: Fixture =
        serde_json::from_str(include_str!("detection.json")).expect("as make_detection.py writes it");
    for group in &fixture.groups {
        let scenes: Vec<_> = group.scenes.iter().map(|rows| fixture.scene(rows)).collect();
        let scenes: Vec<_> =
            scenes.iter().map(|(sequence, velocities)| Scene { sequence, velocities }).collect();
        check(group, &scenes);
    }
}

#[track_caller]
fn assert_near(what: &str, ours: f64, theirs: f64) {
    assert!((ours - theirs).abs() <= 1e-6, "{what}: {ours}, expected {theirs}");
}

#[test]
fn precisions_and_errors_of_every_class_are_the_devkits() {
    each_group(|group, scenes| {
        let figures = DetectionFigures::of(scenes);
        assert_eq!(figures.classes.len(), group.nuscenes.len(), "{}", group.name);
        for ours in &figures.classes {
            let name = serde_json::to_value(ours.class).unwrap();
            let theirs = &group.nuscenes[name.as_str().unwrap()];
            let what = format!("{}, {name}", group.name);
            ours.ap.iter().zip(theirs.ap).for_each(|(ours, theirs)| assert_near(&what, *ours, theirs));
            for (ours, theirs) in ours.errors.iter().zip(theirs.errors) {
                assert_eq!(ours.is_some(), theirs.is_some(), "{what}");
                assert_near(&what, ours.unwrap_or(0.0), theirs.unwrap_or(0.0));
            }
        }
        let n = group.nuscenes.len() as f64 * 4.0;
        let theirs: f64 = group.nuscenes.values().flat_map(|class| class.ap).sum();
        assert_near(&group.name, figures.map().unwrap(), theirs / n);
    });
}

#[test]
fn precisions_at_overlaps_are_opencoods() {
    each_group(|group, scenes| {
        let ours = average_precisions(scenes).unwrap();
        ours.iter().zip(group.overlap).for_each(|(ours, theirs)| assert_near(&group.name, *ours, theirs));
    });
}
