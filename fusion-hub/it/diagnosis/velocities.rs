//! Velocities in other units, or along other axes.

use super::crossing::{Frame, assert_only, found, noise};
use v2x_common::geometry::Pose;
use v2x_fusion_hub::diagnosis::Code;

/// Reported as these make of them; speeds of the crossing are by lane.
fn report(frame: &mut Frame, write: impl Fn([f64; 2], &Pose, f64) -> [f64; 2]) {
    let pose = frame.pose;
    for one in &mut frame.detections {
        let (sin, cos) = libm::sincos(one.yaw);
        // The cars of each lane drive at their own speed.
        let speed = match (cos.abs() > 0.7, cos > 0.0, sin > 0.0) {
            (true, true, _) => 9.0,
            (true, false, _) => 8.0,
            (false, _, true) => 10.0,
            (false, _, false) => 7.0,
        };
        one.velocity = Some(write([speed * cos, speed * sin], &pose, one.yaw));
    }
}

fn turned([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(angle);
    [x * cos - y * sin, x * sin + y * cos]
}

#[test]
fn velocities_in_other_units_and_along_other_axes_are_named_and_right_ones_are_not() {
    type Write = fn([f64; 2], &Pose, f64) -> [f64; 2];
    let right: Write = |velocity, _, _| velocity;
    assert_eq!(found(|frame| report(frame, right)), []);
    let cases: [(&str, Write); 7] = [
        ("km/h", |velocity, _, _| velocity.map(|one| 3.6 * one)),
        ("miles per hour", |velocity, _, _| velocity.map(|one| one / 0.447_04)),
        ("along the axes of its sensor", |velocity, pose, _| turned(velocity, -pose.yaw)),
        ("along and across its boxes", |velocity, _, yaw| turned(velocity, -yaw)),
        ("the other way round", |[x, y], _, _| [-x, -y]),
        ("speeds and directions of motion", |[x, y], _, _| [libm::hypot(x, y), libm::atan2(y, x)]),
        ("the wrong way round in x and y", |[x, y], _, _| [y, x]),
    ];
    for (words, write) in cases {
        assert_only(&found(|frame| report(frame, write)), Code::Velocities, words);
    }
}

#[test]
fn velocities_relative_to_a_vehicle_that_moves_are_named() {
    let drives = [6.0, 0.0];
    let found = found(|frame| {
        let t = 1e-3 * frame.captured_ms as f64;
        frame.pose.x += drives[0] * t - 70.0;
        report(frame, |[x, y], _, _| [x - drives[0], y - drives[1]]);
    });
    assert_only(&found, Code::Velocities, "relative to its sensor");
}

#[test]
fn velocities_that_are_zero_or_wrong_by_a_factor_are_named_and_those_of_what_stands_are_not() {
    let times =
        |factor: f64| found(move |frame| report(frame, |velocity, _, _| velocity.map(|one| factor * one)));
    for (factor, words) in [
        (0.0, "are zero, also of what moves"),
        (0.1, "metres in each frame"),
        (0.3, "times as large as what it sees moves, by"),
        (1.0 / 0.3048, "feet per second"),
    ] {
        assert_only(&times(factor), Code::Velocities, words);
    }
    // A filter that lags, and a sensor that is a fifth off.
    for factor in [0.6, 0.8, 1.2] {
        let found = times(factor);
        assert!(found.iter().all(|one| one.code != Code::Velocities), "{factor}: {found:#?}");
    }
}

/// Cars in rows that are closely parked, each of them missed in two frames of five.
fn parked(frame: &mut Frame) {
    let n = frame.sequence;
    let all = frame.detections.clone();
    let cars = all.iter().cycle().zip(0..30_u32).filter(|(_, k)| (7 * n + 3 * u64::from(*k)) % 5 > 1);
    let cars = cars.map(|(car, k)| {
        let mut car = car.clone();
        (car.x, car.y, car.yaw) = (2.6 * f64::from(k % 15) - 20.0, 9.0 + 6.0 * f64::from(k / 15), 1.57);
        car.x += 0.2 * noise(n, u64::from(k), 0);
        car.y += 0.2 * noise(n, u64::from(k), 1);
        car.velocity = Some([0.0, 0.0]);
        car
    });
    frame.detections = cars.collect();
}

#[test]
fn zero_velocities_of_what_is_parked_and_of_a_few_that_move_are_right() {
    let found = super::crossing::findings_where("", |_| {}, parked, |_| {}, |_| None);
    assert!(found.iter().all(|one| one.code != Code::Velocities), "{found:#?}");
}
