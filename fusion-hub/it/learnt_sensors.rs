//! What is learnt of detectors that see some classes less surely than others, and of what they report that is not there.

use crate::world::{agent, at, box_of, description, draw, frame};
use v2x_common::class::Class;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::geometry::Pose;
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::learning::LearntSensorReport;

const FRAMES: i64 = 300;
/// From here on things are judged.
const LEARNT_AT: i64 = 150;
/// False detections lie this far from the sensor at most, m.
const REACH_M: f64 = 50.0;

/// How the detectors of a run are.
#[derive(Clone, Copy)]
struct Detectors {
    /// Detection probabilities of cars and of people.
    cars: f64,
    people: f64,
    /// Mean number of false detections in a frame: two draws with half of it.
    n_false: f64,
    /// What both declare: false detections per m²; `None` declares nothing.
    declared: Option<f64>,
}

/// What came of a run.
struct Outcome {
    /// Share of lists that hold an object, of cars and of people.
    found: [f64; 2],
    /// Published objects that are none, in the mean of a list.
    n_false: f64,
    /// Of the first agent.
    learnt: LearntSensorReport,
}

/// Six cars and six people that stand in two rows, seen by two agents in different places.
fn places() -> impl Iterator<Item = (Class, [f64; 2])> {
    let cars = (0..6).map(|k| (Class::Car, [f64::from(8 * k) - 20.0, 12.0]));
    cars.chain((0..6).map(|k| (Class::Adult, [f64::from(8 * k) - 20.0, -12.0])))
}

fn detections(k: i64, sensor: i64, detectors: &Detectors, pose: &Pose) -> Vec<Detection> {
    let mut reports = Vec::new();
    for (what, (class, [x, y])) in (0..).zip(places()) {
        let probability = if class == Class::Car { detectors.cars } else { detectors.people };
        if draw(k, sensor, what) < probability {
            let error = |axis: i64| 0.5 * (draw(k, sensor, 100 + 2 * what + axis) - 0.5);
            reports.push(box_of(class, 0.3, [x + error(0), y + error(1)]));
        }
    }
    let n = 2.0 * detectors.n_false * draw(k, sensor, 200);
    for what in 0..libm::round(n) as i64 {
        let radius = REACH_M * libm::sqrt(draw(k, sensor, 300 + what));
        let angle = std::f64::consts::TAU * draw(k, sensor, 400 + what);
        reports.push(box_of(
            Class::Car,
            0.3,
            [pose.x + radius * libm::cos(angle), pose.y + radius * libm::sin(angle)],
        ));
    }
    reports
}

fn run(detectors: &Detectors) -> Outcome {
    let mut engine = Engine::new(EngineConfig::new(HubId::new("hub").expect("test input"), 1));
    let agents = [("first", -10.0), ("second", 15.0)];
    if let Some(clutter_per_m2) = detectors.declared {
        for (name, _) in agents {
            let mut declared = description(clutter_per_m2);
            declared.field_of_view.range_max_m = REACH_M;
            engine.handle_description(agent(name), declared).expect("a valid description");
        }
    }
    let (mut found, mut n_false) = ([0.0; 2], 0.0);
    for k in 0..FRAMES {
        for (sensor, (name, x)) in (0..).zip(agents) {
            let (pose, ms) = (Pose { x, y: 0.0, yaw: 0.0 }, 100 * k + 30 * sensor);
            let reports = detections(k, sensor, detectors, &pose);
            let sequence = u64::try_from(k).expect("a number");
            let sent =
                DetectionFrame { sensor_pose: Some(pose), ..frame(agent(name), sequence, ms, reports) };
            engine.handle_frame(&sent, at(ms + 10));
        }
        if k < LEARNT_AT {
            continue;
        }
        let objects = &engine.fused(at(100 * k + 60)).objects;
        let near = |[x, y]: [f64; 2], radius_m: f64| {
            objects.iter().filter(|one| libm::hypot(one.bev.x - x, one.bev.y - y) < radius_m).count()
        };
        for (class, place) in places() {
            let of = usize::from(class != Class::Car);
            found[of] += if near(place, 1.5) > 0 { 1.0 } else { 0.0 };
        }
        let real: usize = places().map(|(_, place)| near(place, 3.0)).sum();
        n_false += objects.len().saturating_sub(real) as f64;
    }
    let lists = (FRAMES - LEARNT_AT) as f64;
    let learnt = engine.learnt(&agent("first")).expect("an agent with frames");
    Outcome { found: found.map(|n| n / (6.0 * lists)), n_false: n_false / lists, learnt }
}

#[test]
fn people_that_detectors_hold_in_four_of_ten_frames_stay_beside_cars_that_they_hardly_miss() {
    let detectors = Detectors { cars: 0.95, people: 0.4, n_false: 0.0, declared: None };
    let Outcome { found: [cars, people], learnt, .. } = run(&detectors);
    assert!(cars > 0.98 && people > 0.9, "found {cars} of cars, {people} of people");
    let by_class = &learnt.detection_probability_by_class;
    let of = |name: &str| by_class.get(name).copied().unwrap_or(f64::NAN);
    assert!((of("cars and larger") - 0.95).abs() < 0.03 && (of("people") - 0.4).abs() < 0.06, "{by_class:?}");
}

#[test]
fn a_declared_probability_that_does_not_hold_of_people_is_overruled_and_they_stay() {
    let detectors = Detectors { cars: 0.95, people: 0.4, n_false: 0.0, declared: Some(1e-5) };
    let Outcome { found: [cars, people], learnt, .. } = run(&detectors);
    assert!(learnt.overrules_declared, "{learnt:?}");
    assert!(cars > 0.98 && people > 0.9, "found {cars} of cars, {people} of people");
}

#[test]
fn false_detections_of_agents_that_declare_nothing_are_counted() {
    for n_false in [0.5, 6.0] {
        let learnt = run(&Detectors { cars: 0.95, people: 0.9, n_false, declared: None }).learnt;
        let per_frame = learnt.false_per_frame.expect("frames");
        assert!((0.7 * n_false..1.4 * n_false + 0.3).contains(&per_frame), "{n_false}: {per_frame}");
    }
}

#[test]
fn false_detections_that_nobody_declared_are_learnt_and_not_published() {
    let outcome = run(&Detectors { cars: 0.95, people: 0.9, n_false: 8.0, declared: Some(1e-7) });
    assert!(outcome.learnt.overrules_declared_clutter, "{:?}", outcome.learnt);
    assert!(outcome.n_false < 0.3, "{} false objects in a list", outcome.n_false);
    assert!(outcome.found.iter().all(|share| *share > 0.97), "{:?}", outcome.found);
}

#[test]
fn who_declares_that_nothing_is_false_and_reports_much_that_is_loses_nothing_that_is_real() {
    let outcome = run(&Detectors { cars: 0.95, people: 0.9, n_false: 8.0, declared: Some(0.0) });
    assert!(outcome.learnt.overrules_declared_clutter, "{:?}", outcome.learnt);
    assert!(outcome.found.iter().all(|share| *share > 0.97), "{:?}", outcome.found);
    assert!(outcome.n_false < 0.5, "{} false objects in a list", outcome.n_false);
}

#[test]
fn a_declared_density_that_holds_is_kept() {
    let area_m2 = std::f64::consts::PI * REACH_M * REACH_M;
    let learnt =
        run(&Detectors { cars: 0.95, people: 0.95, n_false: 2.0, declared: Some(2.0 / area_m2) }).learnt;
    assert!(!learnt.overrules_declared && !learnt.overrules_declared_clutter, "{learnt:?}");
}
