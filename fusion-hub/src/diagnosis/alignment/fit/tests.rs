use super::super::Sighting;
use super::super::change::{Axes, Unit};
use super::*;
use v2x_common::geometry::Pose;

/// Cars on two roads that cross, at a time (s): place (m) and velocity (m/s).
fn traffic(t: f64) -> Vec<([f64; 2], [f64; 2])> {
    let mut cars = Vec::new();
    for k in 0..3 {
        let along = 22.0 * f64::from(k) - 40.0;
        cars.push(([along + 9.0 * t, -2.0], [9.0, 0.0]));
        cars.push(([40.0 - along - 8.0 * t, 2.0], [-8.0, 0.0]));
        cars.push(([-2.0, 31.0 - along - 7.0 * t], [0.0, -7.0]));
        cars.push(([2.0, along + 5.0 + 10.0 * t], [0.0, 10.0]));
    }
    // Parked ones.
    cars.extend((0..4).map(|k| ([15.0 + 6.5 * f64::from(k), 9.0], [0.0, 0.0])));
    cars
}

/// An error that is the same in each run, m.
fn error(seed: usize, k: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "small")]
    let phase = (seed * 31 + k * 17) as f64;
    0.5 * libm::sin(phase * 1.7)
}

const FIRST: Pose = Pose { x: -31.0, y: -25.0, yaw: 0.4 };
const POSE: Pose = Pose { x: 20.0, y: -12.0, yaw: 1.9 };

/// What both agents see, and what the second one makes of it; each misses every fifth car.
fn fit_of(second: impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) -> Fit {
    let snapshots: Vec<Snapshot> = (0..10)
        .map(|step| {
            let cars = traffic(0.5 * f64::from(step));
            let seed = usize::try_from(step).unwrap();
            let sighting = |whose: usize| {
                let seen = cars.iter().enumerate().filter(|(k, _)| !(k + whose + seed).is_multiple_of(5));
                let spots = seen.map(|(k, (at, velocity))| {
                    let measured = [at[0] + error(seed + whose, k), at[1] + error(seed + 3 * whose, k + 7)];
                    let at = if whose == 1 { second(measured, *velocity) } else { measured };
                    Spot { at, velocity: *velocity, variance: 0.25, size: None }
                });
                Sighting::new(Some([FIRST, POSE][whose]), spots.collect())
            };
            [sighting(0), sighting(1)]
        })
        .collect();
    fit(&snapshots)
}

fn relative([x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = libm::sincos(POSE.yaw);
    let (x, y) = (x - POSE.x, y - POSE.y);
    [x * cos + y * sin, y * cos - x * sin]
}

fn large(fit: Fit) -> Option<(usize, Change)> {
    match fit {
        Fit::Changed { whose, change, .. } => Some((whose, change)),
        _ => None,
    }
}

#[test]
fn agents_that_agree_within_their_errors_agree() {
    assert_eq!(fit_of(|at, _| at), Fit::Agree { clocks: true });
    assert_eq!(fit_of(|[x, y], _| [x + 0.3, y - 0.2]), Fit::Agree { clocks: true });
}

#[test]
fn positions_from_the_sensor_and_mirrored_ones_are_distinguished() {
    assert_eq!(large(fit_of(|at, _| relative(at))), Some((1, Change::FromSensor(Axes::Ours))));
    let right = fit_of(|at, _| {
        let [ahead, left] = relative(at);
        [ahead, -left]
    });
    assert_eq!(large(right), Some((1, Change::FromSensor(Axes::SecondReversed))));
    let mirrored = fit_of(|at, _| {
        let [ahead, left] = relative(at);
        POSE.offset(ahead, -left).into()
    });
    assert_eq!(large(mirrored), Some((1, Change::AboutSensor(Axes::SecondReversed))));
    assert_eq!(large(fit_of(|[x, y], _| POSE.offset(x, y).into())), Some((1, Change::PoseTwice)));
    assert_eq!(large(fit_of(|[x, y], _| [y, x])), Some((1, Change::OfMap(Axes::Swapped))));
    assert_eq!(large(fit_of(|[x, y], _| [x, -y])), Some((1, Change::OfMap(Axes::SecondReversed))));
}

fn rigid(fit: Fit) -> Rigid {
    match fit {
        Fit::Changed { whose: 1, change: Change::Rigid(rigid), share, is_time_known: true }
            if share > 0.5 =>
        {
            rigid
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_shift_is_found_however_large_and_nothing_else() {
    for by_m in [[1.5, -1.0], [4.0, 7.0], [-9.0, 2.0]] {
        let Rigid { by_m: found, turn_rad, earlier_s, .. } =
            rigid(fit_of(|[x, y], _| [x + by_m[0], y + by_m[1]]));
        assert!((0..2).all(|axis| (found[axis] + by_m[axis]).abs() < 0.4), "{by_m:?}: {found:?}");
        assert_eq!((turn_rad, earlier_s), (0.0, 0.0));
    }
}

#[test]
fn a_turn_about_the_sensor_is_found() {
    for turn in [0.06, -0.2] {
        let (sin, cos) = libm::sincos(turn);
        let turned = rigid(fit_of(|[x, y], _| {
            let (x, y) = (x - POSE.x, y - POSE.y);
            [POSE.x + x * cos - y * sin, POSE.y + x * sin + y * cos]
        }));
        assert!((turned.turn_rad + turn).abs() < 0.02, "{turn}: {turned:?}");
        assert_eq!((turned.by_m, turned.earlier_s), ([0.0, 0.0], 0.0));
    }
}

#[test]
fn a_clock_that_is_behind_is_distinguished_from_a_shift_where_roads_cross() {
    for behind_s in [0.15, 0.3, 0.8] {
        // Its stamps are of an earlier time than its positions.
        let late = rigid(fit_of(|at, velocity| [0, 1].map(|axis| at[axis] + behind_s * velocity[axis])));
        assert!((late.earlier_s - behind_s).abs() < 0.05, "{behind_s}: {late:?}");
        assert_eq!((late.by_m, late.turn_rad), ([0.0, 0.0], 0.0));
    }
}

#[test]
fn rows_of_parked_cars_of_which_each_agent_sees_one_are_no_shift() {
    let row = |y: f64| -> Vec<_> {
        let place =
            |k: i32| Spot { at: [6.5 * f64::from(k), y], velocity: [0.0, 0.0], variance: 0.25, size: None };
        (0..8).map(place).collect()
    };
    let snapshots: Vec<Snapshot> =
        (0..10).map(|_| [Sighting::new(None, row(0.0)), Sighting::new(None, row(10.0))]).collect();
    assert_eq!(fit(&snapshots), Fit::Apart { without_pose: [true, true] });
    let pose = Pose { x: 0.0, y: -20.0, yaw: 0.0 };
    let with_poses: Vec<Snapshot> = (0..10)
        .map(|_| [Sighting::new(Some(pose), row(0.0)), Sighting::new(Some(pose), row(10.0))])
        .collect();
    assert_eq!(fit(&with_poses), Fit::Unknown);
}

/// Cars that stand where nothing repeats, of which both agents see the same, and a few that drive.
fn stood_about(n_moving: usize, seen_by_the_second: impl Fn([f64; 2]) -> [f64; 2]) -> Fit {
    let standing =
        [[5.0, 15.0], [-12.0, 3.0], [22.0, -7.0], [31.0, 18.0], [-27.0, -14.0], [9.0, -21.0], [-6.0, 33.0]];
    let snapshots: Vec<Snapshot> = (0..10)
        .map(|step| {
            let seed = usize::try_from(step).unwrap();
            let moving = traffic(0.5 * f64::from(step)).into_iter().take(n_moving);
            let cars: Vec<_> = standing.map(|at| (at, [0.0; 2])).into_iter().chain(moving).collect();
            [0, 1].map(|whose| {
                let spots = cars.iter().enumerate().map(|(k, (at, velocity))| {
                    let measured = [at[0] + error(seed + whose, k), at[1] + error(seed + 3 * whose, k + 7)];
                    let at = if whose == 1 { seen_by_the_second(measured) } else { measured };
                    Spot { at, velocity: *velocity, variance: 0.25, size: None }
                });
                Sighting::new(Some([FIRST, POSE][whose]), spots.collect())
            })
        })
        .collect();
    fit(&snapshots)
}

#[test]
fn a_shift_is_found_where_most_or_all_of_what_is_seen_stands() {
    for n_moving in [0, 3] {
        for shift in [[0.0, 1.5], [1.5, -0.8], [3.0, 0.0], [5.0, 3.0]] {
            let rigid = rigid(stood_about(n_moving, |[x, y]| [x + shift[0], y + shift[1]]));
            let [x, y] = rigid.by_m;
            let off = libm::hypot(x + shift[0], y + shift[1]);
            assert!(off < 0.5 && rigid.turn_rad == 0.0, "{n_moving} moving, {shift:?}: {rigid:?}");
        }
        assert!(matches!(stood_about(n_moving, |at| at), Fit::Agree { .. }));
    }
}

#[test]
fn agents_of_one_area_that_see_different_objects_are_apart() {
    let elsewhere = fit_of(|[x, y], _| [1.7 * x + 3.0 * libm::sin(y), 0.4 * y + 11.0 * libm::cos(x)]);
    assert_eq!(elsewhere, Fit::Apart { without_pose: [false, false] });
    let next = fit_of(|[x, y], _| [1.7 * x + 3.0 * libm::sin(y) + 130.0, 0.4 * y + 11.0 * libm::cos(x)]);
    assert_eq!(next, Fit::Unknown);
}

#[test]
fn a_shift_of_what_moves_at_an_unknown_speed_may_be_one_of_time_and_of_what_stands_it_is_none() {
    let of = |moves_by_m: f64, apart: f64| {
        let sighting = |step: u32, by_m: f64| {
            let spots = (0..12_i32).map(|k| {
                let (column, row) = (k % 4, k / 4);
                let x =
                    17.0 * f64::from(column) + 3.1 * f64::from(row * column) + moves_by_m * f64::from(step);
                Spot { at: [x + by_m, 9.0 * f64::from(row)], velocity: [0.0; 2], variance: 0.25, size: None }
            });
            Sighting::new(None, spots.collect())
        };
        let snapshots: Vec<Snapshot> =
            (0..10).map(|step| [sighting(step, 0.0), sighting(step, apart)]).collect();
        fit(&snapshots)
    };
    for (moves_by_m, is_known) in [(0.0, true), (4.5, false)] {
        let found = of(moves_by_m, 1.2);
        assert!(
            matches!(found, Fit::Changed { change: Change::Rigid(_), is_time_known, .. } if is_time_known == is_known),
            "{moves_by_m}: {found:?}"
        );
    }
}

#[test]
fn what_a_change_of_unit_draws_together_onto_a_vehicle_that_the_other_one_sees_is_no_finding() {
    // The second agent drives, the first one sees it, and nothing else in common.
    let snapshots: Vec<Snapshot> = (0..12)
        .map(|step| {
            let pose = Pose { x: 4.0 * f64::from(step), y: 0.0, yaw: 0.0 };
            let spot = |at: [f64; 2]| Spot { at, velocity: [0.0; 2], variance: 0.1, size: None };
            let around =
                (0..8).map(|k| spot([pose.x + 5.0 + 7.0 * f64::from(k), 11.0 + 3.0 * f64::from(k % 3)]));
            let first = Sighting::new(Some(FIRST), vec![spot([pose.x, pose.y]), spot([-60.0, -40.0])]);
            [first, Sighting::new(Some(pose), around.collect())]
        })
        .collect();
    let found = large(fit(&snapshots));
    assert!(found.is_none_or(|(_, change)| !change.is_of_unit()), "{found:?}");
}

#[test]
fn units_of_length_are_told_apart() {
    for unit in [Unit::Centimetre, Unit::Millimetre, Unit::Decimetre, Unit::Foot] {
        let of_map = fit_of(|at, _| at.map(|one| one / unit.metres()));
        assert_eq!(large(of_map), Some((1, Change::InUnit(unit))));
        let about_sensor = fit_of(|at, _| {
            let [ahead, left] = relative(at).map(|one| one / unit.metres());
            POSE.offset(ahead, left).into()
        });
        assert_eq!(large(about_sensor), Some((1, Change::InUnitAboutSensor(unit))));
    }
}
