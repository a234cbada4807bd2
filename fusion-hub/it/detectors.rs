//! Detectors as they are: headings that are turned, classes that disagree, doubled boxes, sensors that declare nothing or
//! what is not true.

use crate::world::{agent, at, description, frame};
use std::f64::consts::{FRAC_PI_2, PI};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::{BevBox, Pose, angle_difference, wrap_angle};
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::fusion::{Births, MotionModel};

const MOTIONS: [MotionModel; 2] = [MotionModel::Cv, MotionModel::Imm];
const SPEED_MPS: f64 = 8.0;

/// With what a user has who configures nothing.
fn config() -> EngineConfig {
    EngineConfig::new(HubId::new("hub").expect("test input"), 1)
}

fn engine(motion: MotionModel) -> Engine {
    Engine::new(config().with_tracking(|tracking| tracking.motion = motion))
}

/// Errors that repeat in no short period: in [-1, 1].
fn error(k: i64, what: i64) -> f64 {
    let mixed = (k * 7919 + what * 104_729).wrapping_mul(2_654_435_761).rem_euclid(2001);
    f64::from(i32::try_from(mixed).expect("below 2001")) / 1000.0 - 1.0
}

/// A report of a car along x, σ 0.3 m and 0.1 rad.
fn car(x: f64, y: f64, yaw: f64) -> Detection {
    Detection {
        class: Class::Car,
        score: 1.0,
        bev: BevBox { x, y, w: 1.8, d: 4.5, yaw: wrap_angle(yaw) },
        covariance: BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.01, dd: 0.04, yaw: 0.01 },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

/// Frames at 10 Hz of a car that drives east, with the yaw of the `k`-th report; the lists at their times.
fn drive(engine: &mut Engine, speed_mps: f64, n: i64, yaw: impl Fn(i64) -> f64) -> Vec<Vec<FusedObject>> {
    (0..n)
        .map(|k| {
            let x = speed_mps * 0.1 * k as f64 + 0.4 * error(k, 0);
            let report = car(x, 0.4 * error(k, 1), yaw(k) + 0.1 * error(k, 2));
            let sent = frame(agent("lidar"), u64::try_from(k).expect("a number"), 100 * k, vec![report]);
            engine.handle_frame(&sent, at(100 * k + 40));
            engine.fused(at(100 * k + 50)).objects.clone()
        })
        .collect()
}

fn only(objects: &[FusedObject]) -> &FusedObject {
    assert_eq!(objects.len(), 1, "{objects:?}");
    &objects[0]
}

fn velocity_error(object: &FusedObject) -> f64 {
    libm::hypot(object.velocity.0 - SPEED_MPS, object.velocity.1)
}

#[test]
fn a_third_of_headings_turned_round_leaves_one_car_with_its_velocity_and_front() {
    for motion in MOTIONS {
        let lists = drive(&mut engine(motion), SPEED_MPS, 80, |k| if k % 3 == 0 { PI } else { 0.0 });
        let first = only(&lists[20]).track;
        for objects in &lists[20..] {
            let object = only(objects);
            assert_eq!(object.track, first);
            assert!(velocity_error(object) < 2.0, "{motion:?}: {object:?}");
            assert!(object.bev.yaw.abs() < 0.3, "{motion:?}: {object:?}");
        }
    }
}

#[test]
fn a_constant_error_of_the_heading_costs_no_velocity() {
    for motion in MOTIONS {
        for offset_deg in [30.0_f64, 90.0, -90.0] {
            let lists = drive(&mut engine(motion), SPEED_MPS, 80, |_| offset_deg.to_radians());
            let errors = lists[20..].iter().map(|objects| velocity_error(only(objects)));
            let mean = errors.sum::<f64>() / 60.0;
            assert!(mean < 1.0, "{motion:?}, {offset_deg} degrees: {mean} m/s");
        }
    }
}

#[test]
fn a_parked_car_whose_headings_are_turned_round_stands_along_its_axis_and_says_that_it_is_one() {
    for motion in MOTIONS {
        let lists = drive(&mut engine(motion), 0.0, 60, |k| if k % 3 == 0 { PI } else { 0.0 });
        for objects in &lists[10..] {
            let object = only(objects);
            assert!(libm::sin(object.bev.yaw).abs() < 0.34, "{motion:?}: sideways, {object:?}");
        }
        let axes = lists[10..].iter().filter(|objects| only(objects).heading == HeadingKind::Axis).count();
        assert!(axes > 25, "{motion:?}: {axes} of 50");
        let axis =
            lists[10..].iter().map(|objects| only(objects)).find(|one| one.heading == HeadingKind::Axis);
        assert!(axis.is_some_and(|one| one.yaw_variance > 0.3), "the variance holds both ends: {axis:?}");
    }
}

/// The heading kinds of a car's list after so many frames, where each report declares a kind.
fn kind_of(declared: HeadingKind, speed_mps: f64, n: i64) -> (HeadingKind, f64) {
    let mut engine = engine(MotionModel::Imm);
    for k in 0..n {
        let mut report = car(speed_mps * 0.1 * k as f64 + 0.3 * error(k, 0), 0.0, 0.1 * error(k, 2));
        report.heading = declared;
        let sent = frame(agent("lidar"), u64::try_from(k).expect("a number"), 100 * k, vec![report]);
        engine.handle_frame(&sent, at(100 * k + 40));
    }
    let object = only(&engine.fused(at(100 * n)).objects).clone();
    (object.heading, object.bev.yaw)
}

#[test]
fn what_detections_declare_of_their_headings_is_published_until_motion_says_more() {
    assert_eq!(kind_of(HeadingKind::Known, 0.0, 30).0, HeadingKind::Known);
    assert_eq!(kind_of(HeadingKind::Axis, 0.0, 30).0, HeadingKind::Axis);
    assert_eq!(kind_of(HeadingKind::Unknown, 0.0, 30).0, HeadingKind::Unknown);
    for declared in [HeadingKind::Axis, HeadingKind::Unknown] {
        let (kind, yaw) = kind_of(declared, SPEED_MPS, 40);
        assert!(kind == HeadingKind::Known && yaw.abs() < 0.2, "{declared:?}: {kind:?}, {yaw}");
    }
}

#[test]
fn a_slow_car_whose_heading_nobody_reports_moves_as_its_positions_do_in_any_direction() {
    for (dx, dy) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let mut engine = engine(MotionModel::Imm);
        for k in 0..50_i64 {
            let way = 0.1 * k as f64;
            let mut report = Detection { heading: HeadingKind::Unknown, ..car(way * dx, way * dy, 0.0) };
            report.covariance.position = Covariance2::isotropic(0.5);
            let sent = frame(agent("camera"), u64::try_from(k).expect("a number"), 100 * k, vec![report]);
            engine.handle_frame(&sent, at(100 * k + 20));
        }
        let object = only(&engine.fused(at(4920)).objects).clone();
        let error = libm::hypot(object.velocity.0 - dx, object.velocity.1 - dy);
        assert!(error < 0.3, "{object:?}");
    }
}

#[test]
fn exchanged_width_and_depth_with_a_quarter_turn_change_nothing() {
    let mut engine = engine(MotionModel::Imm);
    for k in 0..60_i64 {
        let mut report = car(0.8 * k as f64 + 0.4 * error(k, 0), 0.4 * error(k, 1), 0.1 * error(k, 2));
        if k % 4 == 3 {
            (report.bev.w, report.bev.d) = (report.bev.d, report.bev.w);
            (report.covariance.ww, report.covariance.dd) = (report.covariance.dd, report.covariance.ww);
            report.bev.yaw = wrap_angle(report.bev.yaw + FRAC_PI_2);
        }
        let sent = frame(agent("lidar"), u64::try_from(k).expect("a number"), 100 * k, vec![report]);
        engine.handle_frame(&sent, at(100 * k + 40));
    }
    let object = only(&engine.fused(at(5950)).objects).clone();
    assert!(velocity_error(&object) < 1.0 && object.bev.yaw.abs() < 0.2, "{object:?}");
    assert!(object.bev.d > 4.0 && object.bev.w < 2.2, "{object:?}");
}

#[test]
fn agents_that_disagree_about_the_class_of_a_vehicle_report_one_object_of_both() {
    let mut engine = engine(MotionModel::Imm);
    for k in 0..40_i64 {
        for (name, class) in [("camera", Class::Truck), ("lidar", Class::Car)] {
            let x = 0.8 * k as f64 + 0.4 * error(k, 0);
            let report = Detection { class, ..car(x, 0.0, 0.1 * error(k, 2)) };
            let sent = frame(agent(name), u64::try_from(k).expect("a number"), 100 * k, vec![report]);
            engine.handle_frame(&sent, at(100 * k + 40));
        }
    }
    let object = only(&engine.fused(at(3960)).objects).clone();
    let mut classes: Vec<_> = object.class_probabilities.iter().map(|(class, _)| *class).collect();
    classes.sort_unstable();
    assert_eq!(classes, [Class::Car, Class::Truck], "{object:?}");
    assert!(object.class_conflict > 0.6, "and that they disagree is said: {object:?}");
    assert!(object.class_probabilities.iter().all(|(_, share)| (0.4..0.6).contains(share)), "{object:?}");
}

/// The hub's object of a car that each of these agents takes for a class of its own, `other` only every `n`-th time; and
/// how many objects there were at most.
fn classified(agents: &[(&str, Class, Class, i64)]) -> (FusedObject, usize) {
    let mut engine = engine(MotionModel::Imm);
    let mut most = 0;
    for k in 0..60_i64 {
        for (name, class, other, every) in agents {
            let class = if k % every == 0 { *other } else { *class };
            let x = 0.8 * k as f64 + 0.4 * error(k, 0);
            let report = Detection { class, ..car(x, 0.0, 0.1 * error(k, 2)) };
            let sent = frame(agent(name), u64::try_from(k).expect("a number"), 100 * k, vec![report]);
            engine.handle_frame(&sent, at(100 * k + 40));
        }
        most = most.max(engine.fused(at(100 * k + 60)).objects.len());
    }
    (only(&engine.fused(at(5960)).objects).clone(), most)
}

#[test]
fn one_agent_that_takes_a_van_for_car_and_truck_by_turns_is_undecided_and_contradicts_nobody() {
    let (object, most) = classified(&[("lidar", Class::Car, Class::Truck, 2)]);
    assert!(most == 1 && object.class_conflict < 1e-9, "{object:?}");
    assert!(object.class_probabilities.iter().all(|(_, share)| (0.4..0.6).contains(share)), "{object:?}");
}

#[test]
fn two_agents_outvote_a_third_one_and_what_is_reported_for_long_counts_once() {
    let car = |name| (name, Class::Car, Class::Car, 1);
    let (object, most) = classified(&[car("a"), car("b"), ("c", Class::Truck, Class::Truck, 1)]);
    assert_eq!((object.class, most), (Class::Car, 1), "{object:?}");
    assert!(object.class_probabilities[0].1 > 0.8 && object.class_conflict > 0.5, "{object:?}");
    let (object, _) = classified(&[car("a"), car("b")]);
    assert!(object.class_probabilities[0].1 > 0.99 && object.class_conflict < 1e-9, "{object:?}");
}

#[test]
fn an_agent_without_classes_leaves_them_to_the_others() {
    let unknown = ("radar", Class::Unknown, Class::Unknown, 1);
    let (object, most) = classified(&[unknown, ("camera", Class::Truck, Class::Truck, 1)]);
    assert_eq!((object.class, most), (Class::Truck, 1), "{object:?}");
    assert!(object.class_probabilities[0].1 > 0.95, "{object:?}");
    assert_eq!(classified(&[unknown]).0.class, Class::Unknown);
}

#[test]
fn a_person_and_a_lorry_at_one_place_are_two() {
    let mut engine = engine(MotionModel::Imm);
    for k in 0..20_i64 {
        let mut person = Detection { class: Class::Adult, ..car(1.0, 0.0, 0.0) };
        (person.bev.w, person.bev.d) = (0.6, 0.6);
        let lorry = Detection { class: Class::Truck, ..car(0.0, 0.0, 0.0) };
        let sent = frame(agent("lidar"), u64::try_from(k).expect("a number"), 100 * k, vec![person, lorry]);
        engine.handle_frame(&sent, at(100 * k + 40));
    }
    assert_eq!(engine.fused(at(1950)).objects.len(), 2);
}

#[test]
fn a_detector_that_reports_every_car_twice_makes_one_object() {
    let mut engine = engine(MotionModel::Imm);
    let mut seen = Vec::new();
    for k in 0..60_i64 {
        let x = 0.8 * k as f64;
        let twice = vec![
            car(x + 0.3 * error(k, 0), 0.3 * error(k, 1), 0.0),
            car(x + 0.3 + 0.3 * error(k, 3), 0.3 * error(k, 4), 0.0),
        ];
        let sent = frame(agent("lidar"), u64::try_from(k).expect("a number"), 100 * k, twice);
        engine.handle_frame(&sent, at(100 * k + 40));
        seen.push(engine.fused(at(100 * k + 50)).objects.len());
    }
    assert!(seen[10..].iter().all(|n| *n == 1), "{seen:?}");
}

#[test]
fn a_single_report_of_an_unknown_agent_is_a_candidate_unless_sensors_are_said_to_be_perfect() {
    let published = |births: Births, n: i64| {
        let mut engine = Engine::new(config().with_tracking(|tracking| tracking.births = births));
        for k in 0..n {
            let sent =
                frame(agent("lidar"), u64::try_from(k).expect("a number"), 100 * k, vec![car(0.0, 0.0, 0.0)]);
            engine.handle_frame(&sent, at(100 * k + 40));
        }
        engine.fused(at(100 * n)).objects.len()
    };
    assert_eq!((published(Births::Cautious, 1), published(Births::AtOnce, 1)), (0, 1));
    assert_eq!(published(Births::Cautious, 3), 1);
}

#[test]
fn an_agent_that_declares_certainty_and_sees_nothing_does_not_erase_what_another_reports() {
    let mut engine = engine(MotionModel::Imm);
    let mut certain = description(1e-5);
    certain.detection_probability = 0.999;
    engine.handle_description(agent("blind"), certain).expect("a valid description");
    let (mut published, mut ticks) = (0, 0);
    for k in 0..60_i64 {
        let cars = (0..5_i32).map(|lane| car(20.0, 20.0 * f64::from(lane), 0.0)).collect();
        let sequence = u64::try_from(k).expect("a number");
        engine.handle_frame(&frame(agent("lidar"), sequence, 100 * k, cars), at(100 * k + 20));
        engine.handle_frame(&frame(agent("blind"), sequence, 100 * k + 50, vec![]), at(100 * k + 70));
        // Two seconds pass until it is found out.
        if k >= 30 {
            published += engine.fused(at(100 * k + 80)).objects.len();
            ticks += 1;
        }
    }
    assert!(published >= 5 * ticks * 9 / 10, "{published} of {}", 5 * ticks);
}

#[test]
fn an_agent_that_goes_blind_after_working_for_long_does_not_take_what_others_see() {
    let mut engine = engine(MotionModel::Imm);
    let mut certain = description(1e-4);
    certain.detection_probability = 0.99;
    engine.handle_description(agent("fails"), certain).expect("a valid description");
    let (mut published, mut ticks) = (0, 0);
    for k in 0..500_i64 {
        let cars = || (0..5_i32).map(|lane| car(20.0, 20.0 * f64::from(lane), 0.0)).collect::<Vec<_>>();
        let sequence = u64::try_from(k).expect("a number");
        // A camera that misses two of three.
        let seen =
            (0..).zip(cars()).filter(|(lane, _)| (k + lane) % 3 == 0).map(|(_, report)| report).collect();
        engine.handle_frame(&frame(agent("camera"), sequence, 100 * k, seen), at(100 * k + 20));
        let of_failing = if k < 300 { cars() } else { vec![] };
        engine.handle_frame(&frame(agent("fails"), sequence, 100 * k + 50, of_failing), at(100 * k + 70));
        // Five seconds pass until it is found out.
        if k >= 350 {
            published += engine.fused(at(100 * k + 80)).objects.len();
            ticks += 1;
        }
    }
    assert!(published >= 5 * ticks * 9 / 10, "{published} of {}", 5 * ticks);
}

/// Frames of two agents that describe nothing: one turns headings, the other misses every third object in runs.
fn learnt_from() -> Vec<DetectionFrame> {
    let mut frames = Vec::new();
    for k in 0..120_i64 {
        for (place, name) in [(0, "a"), (1, "b")] {
            let lanes = (0..6_i64).filter(|lane| place == 0 || (k / 5 + lane) % 3 != 0);
            let cars = lanes.map(|lane| {
                let turned = if place == 0 && (k + lane) % 4 == 0 { PI } else { 0.0 };
                let x = 0.5 * k as f64 + 0.3 * error(k, 10 * lane + place);
                let y = 25.0 * lane as f64 + 0.3 * error(k, 10 * lane + place + 5);
                Detection { score: 0.4 + 0.3 * error(k, lane), ..car(x, y, turned) }
            });
            let captured_ms = 100 * k + 30 * place;
            frames.push(frame(agent(name), u64::try_from(k).expect("a number"), captured_ms, cars.collect()));
        }
    }
    frames
}

#[test]
fn what_is_learnt_does_not_depend_on_the_order_of_arrival() {
    let run = |delay_ms: &dyn Fn(usize) -> i64, publish_every: i64| {
        let mut engine = engine(MotionModel::Imm);
        let frames = learnt_from();
        let mut arrivals: Vec<_> = frames
            .iter()
            .enumerate()
            .map(|(place, frame)| {
                let captured_ms = (frame.captured_at - at(0)).as_millis_f64() as i64;
                (captured_ms + delay_ms(place), place)
            })
            .collect();
        arrivals.sort_unstable();
        for (now_ms, place) in arrivals {
            engine.handle_frame(&frames[place], at(now_ms));
            if now_ms % publish_every == 0 {
                engine.fused(at(now_ms));
            }
        }
        let mut objects = engine.fused(at(12_450)).objects.clone();
        objects.sort_by(|a, b| a.bev.y.total_cmp(&b.bev.y));
        // Ids are numbered by arrival.
        let kinematics =
            |one: &FusedObject| (one.bev, one.velocity, one.existence, one.yaw_variance, one.heading);
        objects.iter().map(kinematics).collect::<Vec<_>>()
    };
    let prompt = run(&|_| 10, 50);
    assert_eq!(prompt.len(), 6);
    assert_eq!(run(&|place| 10 + 10 * i64::try_from(place * 37 % 40).expect("small"), 70), prompt);
    assert!(prompt.iter().all(|(bev, ..)| angle_difference(bev.yaw, 0.0).abs() < 0.3), "{prompt:?}");
}

/// The share of lists with the car, and with the ghost, that two agents at different places make. Only the first one reports
/// the ghost.
fn shares_of(car_score: f64, ghost_score: f64) -> [f64; 2] {
    let mut engine = engine(MotionModel::Imm);
    let mut found = [0.0; 2];
    for k in 0..600_u32 {
        let ms = 100 * i64::from(k);
        for (name, east) in [("first", 0.0), ("second", 40.0)] {
            let ks = i64::from(k);
            let there =
                |x: f64, y: f64, score: f64| Detection { score, ..car(x + 0.3 * error(ks, 3), y, 0.0) };
            // The second car shows that both see the place of the ghost.
            let mut reports = vec![
                there(20.0, 5.0, car_score + 0.02 * error(ks, 4)),
                there(32.0, -22.0, car_score + 0.02 * error(ks, 6)),
            ];
            if name == "first" {
                reports.push(there(25.0, -15.0, ghost_score + 0.02 * error(ks, 5)));
            }
            let pose = Some(Pose { x: east, y: 0.0, yaw: 0.0 });
            let sent = DetectionFrame { sensor_pose: pose, ..frame(agent(name), u64::from(k), ms, reports) };
            engine.handle_frame(&sent, at(ms + 40));
        }
        if k >= 500 {
            let objects = &engine.fused(at(ms + 50)).objects;
            for (found, y) in found.iter_mut().zip([5.0, -15.0]) {
                *found +=
                    f64::from(u8::from(objects.iter().any(|object| (object.bev.y - y).abs() < 2.5))) / 100.0;
            }
        }
    }
    found
}

#[test]
fn scores_are_calibrated_by_what_an_agent_elsewhere_confirms() {
    for (car_score, ghost_score) in [(0.9, 0.2), (0.25, 0.08), (0.15, 0.05), (0.97, 0.7)] {
        let [car, ghost] = shares_of(car_score, ghost_score);
        assert!(car > 0.95 && ghost < 0.2, "{car_score}: {car}, {ghost_score}: {ghost}");
    }
}

#[test]
fn a_report_of_hardly_any_certainty_begins_no_object_and_one_of_some_does() {
    for (sigma_m, expected) in [(60.0, 0), (5.0, 1)] {
        let mut engine = Engine::new(config().with_tracking(|tracking| tracking.births = Births::AtOnce));
        for k in 0..5 {
            let mut report = car(0.0, 0.0, 0.0);
            report.covariance.position = Covariance2::isotropic(sigma_m);
            let sent = frame(agent("vague"), k, 100 * k.cast_signed(), vec![report]);
            engine.handle_frame(&sent, at(100 * k.cast_signed() + 10));
        }
        assert_eq!(engine.fused(at(420)).objects.len(), expected, "{sigma_m} m");
    }
}
