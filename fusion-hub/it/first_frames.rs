//! The first second of an agent that describes no sensor, in which nothing is learnt of it: its frames speak for themselves.

use crate::world::{agent, at, frame};
use std::f64::consts::PI;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Engine, EngineConfig};

/// Lanes of parked cars, m.
const LANES: [f64; 6] = [-30.0, -18.0, -6.0, 6.0, 18.0, 30.0];

fn engine() -> Engine {
    Engine::new(EngineConfig::new(HubId::new("hub").expect("test input"), 1))
}

fn car([x, y]: [f64; 2], yaw: f64, score: f64) -> Detection {
    Detection {
        class: Class::Car,
        score,
        bev: BevBox { x, y, w: 1.8, d: 4.5, yaw },
        covariance: BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.02, dd: 0.12, yaw: 0.01 },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

/// What is published after each frame of a sensor at the origin, at 10 Hz.
fn lists(n: u32, detections: impl Fn(u32) -> Vec<Detection>) -> Vec<Vec<FusedObject>> {
    let mut engine = engine();
    let pose = Some(Pose { x: 0.0, y: 0.0, yaw: 0.0 });
    (0..n)
        .map(|k| {
            let ms = 100 * i64::from(k);
            let sent = frame(agent("lidar"), u64::from(k), ms, detections(k));
            engine.handle_frame(&DetectionFrame { sensor_pose: pose, ..sent }, at(ms + 20));
            engine.fused(at(ms + 30)).objects.clone()
        })
        .collect()
}

fn parked(score: f64) -> Vec<Detection> {
    LANES.map(|y| car([25.0, y], 0.0, score)).to_vec()
}

fn is_at(objects: &[FusedObject], [x, y]: [f64; 2]) -> bool {
    objects.iter().any(|object| libm::hypot(object.bev.x - x, object.bev.y - y) < 2.0)
}

#[test]
fn what_a_new_agent_reports_with_low_scores_is_not_published_beside_what_scores_high() {
    let ghost = [-20.0, 10.0];
    let lists = lists(12, |_| [parked(0.8), vec![car(ghost, 0.0, 0.12)]].concat());
    for (k, objects) in lists.iter().enumerate() {
        assert!(!is_at(objects, ghost), "after frame {k}");
        assert!(k == 0 || objects.len() == LANES.len(), "{} cars after frame {k}", objects.len());
    }
}

#[test]
fn one_report_of_an_agent_that_nothing_is_known_of_is_a_candidate_unless_its_score_is_high() {
    let low = || vec![car([-20.0, 10.0], 0.0, 0.12)];
    let first = |detections: Vec<Detection>| lists(1, |_| detections.clone())[0].len();
    assert_eq!(first(parked(1.0)), 0, "scores that are all the same say nothing");
    assert_eq!(first([parked(0.5), low()].concat()), 0, "a middling score");
    assert_eq!(first([parked(0.9), low()].concat()), LANES.len());
}

#[test]
fn what_a_new_agent_reports_twice_and_never_again_is_gone_after_some_misses() {
    let stray = [-20.0, 10.0];
    let lists = lists(7, |k| {
        let strays = if k < 2 { vec![car(stray, 0.0, 1.0)] } else { Vec::new() };
        [parked(1.0), strays].concat()
    });
    assert!(is_at(&lists[1], stray), "twice reported, it is an object");
    for (k, objects) in lists.iter().enumerate().skip(5) {
        assert!(!is_at(objects, stray), "after frame {k}");
        assert_eq!(objects.len(), LANES.len(), "after frame {k}");
    }
}

#[test]
fn a_car_whose_headings_are_all_reversed_points_along_its_motion_within_half_a_second() {
    let lists = lists(20, |k| vec![car([-30.0 + 0.8 * f64::from(k), 0.0], PI, 1.0)]);
    for (k, objects) in lists.iter().enumerate().skip(5) {
        assert_eq!(objects.len(), 1);
        assert!(objects[0].bev.yaw.abs() < 0.3, "after frame {k}: {}", objects[0].bev.yaw);
    }
}
