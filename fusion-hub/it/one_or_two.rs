//! One object that is reported as two, and two that are near each other.

use crate::world::{agent, at, frame};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, HeadingKind};
use v2x_common::geometry::BevBox;
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Engine, EngineConfig};

/// A box of an object.
#[derive(Clone, Copy)]
struct Seen {
    class: Class,
    /// Where it is beside the common course, m.
    place: [f64; 2],
    size: [f64; 2],
    sigma_m: f64,
}

const fn seen(class: Class, place: [f64; 2], size: [f64; 2], sigma_m: f64) -> Seen {
    Seen { class, place, size, sigma_m }
}

/// Errors that repeat in no short period, with a standard deviation of about 0.6.
fn error(k: i64, what: i64) -> f64 {
    let mixed = (k * 7919 + what * 104_729).wrapping_mul(2_654_435_761).rem_euclid(2001);
    f64::from(i32::try_from(mixed).expect("below 2001")) / 1000.0 - 1.0
}

/// What one agent reports of these at a time, along a course that is turned.
fn report(one: &Seen, speed_mps: f64, (k, what): (i64, i64), time_s: f64) -> Detection {
    const COURSE_RAD: f64 = 0.7;
    let (sin, cos) = libm::sincos(COURSE_RAD);
    let [x, y] = one.place;
    let along = x + speed_mps * time_s + one.sigma_m * error(k, 3 * what);
    let across = y + one.sigma_m * error(k, 3 * what + 1);
    let [w, d] = one.size;
    Detection {
        class: one.class,
        score: 0.9,
        bev: BevBox {
            x: along * cos - across * sin,
            y: along * sin + across * cos,
            w,
            d,
            yaw: COURSE_RAD + 0.1 * error(k, 3 * what + 2),
        },
        covariance: BoxCovariance {
            position: Covariance2::isotropic(one.sigma_m),
            ww: 0.0025 * w * w,
            dd: 0.0025 * d * d,
            yaw: 0.01,
        },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

/// How many objects there are after every frame for 12 s, without the first three frames of each agent. Of every agent the
/// boxes of its `k`-th frame are given.
fn counts(hz: i64, agents: &[&str], speed_mps: f64, boxes: impl Fn(usize, i64) -> Vec<Seen>) -> Vec<usize> {
    let config = EngineConfig::new(HubId::new("hub").expect("test input"), 1);
    let mut engine = Engine::new(config);
    let mut counts = Vec::new();
    for k in 0..12 * hz {
        for (place, name) in agents.iter().enumerate() {
            let place_ms = i64::try_from(place).expect("few agents") * 300 / hz;
            let ms = 1000 * k / hz + place_ms;
            let reports = (0..).zip(boxes(place, k));
            let numbered = |what: i64| (k, what + 100 * i64::try_from(place).expect("few agents"));
            let reports = reports
                .map(|(what, one)| report(&one, speed_mps, numbered(what), ms as f64 / 1000.0))
                .collect();
            let sent = frame(agent(name), u64::try_from(k).expect("a number"), ms, reports);
            engine.handle_frame(&sent, at(ms + 20));
            if k >= 3 {
                counts.push(engine.fused(at(ms + 30)).objects.len());
            }
        }
    }
    counts
}

/// Holds that there are so many objects nearly always, at several rates, by one agent and by two.
fn holds(name: &str, expected: usize, speed_mps: f64, boxes: impl Fn(usize, i64) -> Vec<Seen>) {
    for hz in [2, 10] {
        for agents in [&["a"][..], &["a", "b"]] {
            let counts = counts(hz, agents, speed_mps, &boxes);
            let right = counts.iter().filter(|n| **n == expected).count();
            assert!(
                right * 20 >= counts.len() * 19,
                "{name} by {} at {hz} Hz: {right} of {}: {counts:?}",
                agents.len(),
                counts.len()
            );
        }
    }
}

#[test]
fn a_detector_that_reports_every_object_twice_makes_one_of_it_whatever_its_class() {
    let (car, motorcycle, bicycle) = ([1.8, 4.5], [0.8, 2.0], [0.6, 1.8]);
    let twice = [
        (Class::Car, [0.3, 0.0], car, 0.3, 8.0),
        (Class::Motorcycle, [0.4, 0.0], motorcycle, 0.15, 8.0),
        (Class::Motorcycle, [0.0, 0.3], motorcycle, 0.1, 0.0),
        (Class::Bicycle, [0.4, 0.0], bicycle, 0.12, 5.0),
        (Class::Unknown, [0.3, 0.0], car, 0.3, 8.0),
        (Class::Adult, [0.15, 0.1], [0.6, 0.6], 0.08, 1.4),
    ];
    for (class, apart, size, sigma_m, speed_mps) in twice {
        let boxes = |_, _| vec![seen(class, [0.0; 2], size, sigma_m), seen(class, apart, size, sigma_m)];
        holds(class.name(), 1, speed_mps, boxes);
    }
}

#[test]
fn boxes_of_different_classes_that_agree_in_place_and_size_are_of_one_object() {
    let car = [1.8, 4.5];
    holds("car and unknown", 1, 8.0, |_, _| {
        vec![seen(Class::Car, [0.0; 2], car, 0.3), seen(Class::Unknown, [0.3, 0.0], car, 0.3)]
    });
    holds("car and motorcycle", 1, 6.0, |_, _| {
        let size = [1.0, 2.2];
        vec![seen(Class::Motorcycle, [0.0; 2], size, 0.2), seen(Class::Car, [0.2, 0.0], size, 0.2)]
    });
    holds("rider", 1, 5.0, |_, _| {
        vec![
            seen(Class::Bicycle, [0.0; 2], [0.6, 1.8], 0.12),
            seen(Class::Adult, [0.1, 0.0], [0.6, 0.6], 0.12),
        ]
    });
}

#[test]
fn people_in_a_crowd_and_two_wheelers_side_by_side_are_not_lost() {
    let crowd = |_: usize, _: i64| -> Vec<Seen> {
        let places = (0..9).map(|n| [0.7 * f64::from(n % 3), 0.7 * f64::from(n / 3)]);
        places.map(|place| seen(Class::Adult, place, [0.6, 0.6], 0.1)).collect()
    };
    holds("crowd", 9, 0.0, crowd);
    holds("walking crowd", 9, 1.2, crowd);
    holds("motorcycles", 2, 0.0, |_, _| {
        [0.0, 0.8].map(|y| seen(Class::Motorcycle, [0.0, y], [0.8, 2.1], 0.15)).to_vec()
    });
    holds("bicycles in a rack", 6, 0.0, |_, _| {
        let places = (0..6).map(|n| [0.0, 0.5 * f64::from(n)]);
        places.map(|place| seen(Class::Bicycle, place, [0.6, 1.8], 0.08)).collect()
    });
    holds("a person beside a bicycle", 2, 1.2, |_, _| {
        vec![seen(Class::Bicycle, [0.0; 2], [0.6, 1.8], 0.1), seen(Class::Adult, [0.0, 0.6], [0.6, 0.6], 0.1)]
    });
}

#[test]
fn agents_that_take_one_object_for_different_kinds_of_things_report_one() {
    let pairs = [
        (Class::Motorcycle, Class::Car, [1.0, 2.2], 0.2, 6.0),
        (Class::Bicycle, Class::Car, [0.8, 1.9], 0.15, 5.0),
        (Class::Adult, Class::Car, [0.8, 0.9], 0.15, 1.4),
        (Class::Barrier, Class::Car, [1.8, 4.5], 0.3, 0.0),
        (Class::TrafficCone, Class::Adult, [0.5, 0.5], 0.1, 0.0),
    ];
    for (one, other, size, sigma_m, speed_mps) in pairs {
        let boxes =
            |place: usize, _: i64| vec![seen(if place == 0 { one } else { other }, [0.0; 2], size, sigma_m)];
        holds(&format!("{one:?} and {other:?}"), 1, speed_mps, boxes);
        let boxes =
            |_: usize, k: i64| vec![seen(if k % 2 == 0 { one } else { other }, [0.0; 2], size, sigma_m)];
        holds(&format!("{one:?}, {other:?} by turns"), 1, speed_mps, boxes);
    }
}

#[test]
fn a_person_who_is_taken_for_a_cone_by_turns_goes_on_walking() {
    let boxes = |_: usize, k: i64| {
        let class = if k % 2 == 0 { Class::TrafficCone } else { Class::Adult };
        vec![seen(class, [0.0; 2], [0.5, 0.5], 0.1)]
    };
    for agents in [&["a"][..], &["a", "b"]] {
        // Two seconds may pass until it is found out that the cone walks.
        let counts = counts(10, agents, 1.4, boxes);
        let counts = &counts[20 * agents.len()..];
        assert!(counts.iter().all(|n| *n == 1), "{counts:?}");
    }
}

#[test]
fn what_stands_at_an_object_of_another_kind_is_an_object_of_its_own() {
    let car = seen(Class::Car, [0.0; 2], [1.8, 4.5], 0.15);
    let person = |y: f64| seen(Class::Adult, [0.3, y], [0.6, 0.6], 0.15);
    holds("at a car's door", 2, 0.0, |_, _| vec![car, person(0.9)]);
    holds("in the door", 2, 0.0, |_, _| vec![car, person(0.6)]);
    holds("unknown beside a car", 2, 0.0, |_, _| vec![car, Seen { class: Class::Unknown, ..person(1.1) }]);
    let counts = counts(10, &["a", "b"], 0.0, |place, _| vec![if place == 0 { car } else { person(0.9) }]);
    let counts = &counts[20..];
    assert!(counts.iter().all(|n| *n == 2), "each agent sees another one: {counts:?}");
    let cone = seen(Class::TrafficCone, [0.0; 2], [0.4, 0.4], 0.1);
    let person = seen(Class::Adult, [0.6, 0.0], [0.6, 0.6], 0.1);
    let counts = self::counts(10, &["a", "b"], 0.0, |place, _| vec![if place == 0 { cone } else { person }]);
    let counts = &counts[20..];
    assert!(counts.iter().all(|n| *n == 2), "a cone and a person: {counts:?}");
}

#[test]
fn two_people_who_pass_each_other_closely_are_two_at_all_times() {
    for hz in [10, 20] {
        let step_m = 2.0 / hz as f64;
        let counts = counts(hz, &["a"], 1.0, |_, k| {
            // The second one walks towards the first one.
            let apart = 12.0 - step_m * k as f64;
            vec![
                seen(Class::Adult, [0.0; 2], [0.6, 0.6], 0.08),
                seen(Class::Adult, [apart, 0.2], [0.6, 0.6], 0.08),
            ]
        });
        let two = counts.iter().filter(|n| **n == 2).count();
        assert!(two * 50 >= counts.len() * 49, "{hz} Hz: {counts:?}");
    }
}
