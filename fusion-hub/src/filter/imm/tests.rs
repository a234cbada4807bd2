use super::gaussian::at;
use super::*;
use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::PI;
use v2x_common::covariance::Velocity;
use v2x_common::fused::KINEMATIC_INDEX;
use v2x_common::geometry::angle_difference;

const CAR_LENGTH_M: f64 = 4.5;

/// Uniform in `low..high`.
fn between(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * f64::from(random.next_u32()) / 4_294_967_296.0
}

pub(super) fn report(position: [f64; 2], yaw: f64) -> Measurement {
    Measurement {
        class: Class::Car,
        position,
        r: Covariance2::isotropic(0.3),
        size: [1.8, CAR_LENGTH_M],
        relative_variance: [0.04; 2],
        yaw,
        yaw_variance: 0.0025,
        size_law: [None; 2],
        heading: v2x_common::detection::HeadingKind::Known,
        velocity: None,
        is_track: false,
        since_last_s: f64::INFINITY,
    }
}

/// A car measured for two seconds at a steady speed and turn rate, 10 times a second.
pub(super) fn driven(speed: f64, turn_rate: f64, heading: f64) -> Imm {
    let mut imm = Imm::initial(&report([0.0, 0.0], heading));
    let (mut x, mut y) = (0.0, 0.0);
    for step in 1..20 {
        let yaw = heading + turn_rate * 0.1 * (f64::from(step) - 0.5);
        x += 0.1 * speed * libm::cos(yaw);
        y += 0.1 * speed * libm::sin(yaw);
        imm.predict(0.1, Class::Car, CAR_LENGTH_M);
        imm.update(&report([x, y], heading + turn_rate * 0.1 * f64::from(step)), Inflation::NONE);
    }
    imm
}

fn is_positive_definite<const N: usize, const T: usize>(state: &gaussian::Gaussian<N, T>) -> bool {
    // Scaled to a correlation matrix, so that metres and radians are treated alike.
    let sigma: Vec<f64> = (0..N).map(|i| libm::sqrt(state.covariance[at(i, i)])).collect();
    let correlation = DMatrix::from_fn(N, N, |row, column| {
        state.covariance[at(row, column)] / (sigma[row] * sigma[column])
    });
    state.mean.iter().all(|mean| mean.is_finite()) && correlation.cholesky().is_some()
}

pub(super) fn assert_sound(imm: &Imm) {
    assert!(is_positive_definite(&imm.parked), "{imm:?}");
    assert!(is_positive_definite(&imm.stopped), "{imm:?}");
    assert!(is_positive_definite(&imm.smooth), "{imm:?}");
    assert!(is_positive_definite(&imm.manoeuvre), "{imm:?}");
    assert!((imm.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{imm:?}");
    let moments = imm.moments();
    assert!(moments.yaw > -PI && moments.yaw <= PI && moments.yaw_variance > 0.0);
    let full = kinematic(&moments);
    let sigma: Vec<f64> = (0..4).map(|i| libm::sqrt(full[(i, i)])).collect();
    let correlation = DMatrix::from_fn(4, 4, |i, j| full[(i, j)] / (sigma[i] * sigma[j]));
    assert!(correlation.cholesky().is_some(), "{imm:?} {moments:?}");
}

fn kinematic(moments: &Moments) -> DMatrix<f64> {
    let mut full = DMatrix::zeros(4, 4);
    for (value, (row, column)) in moments.covariance.into_iter().zip(KINEMATIC_INDEX) {
        full[(row, column)] = value;
        full[(column, row)] = value;
    }
    full
}

/// Means within this share of a standard deviation, variances within this share, equal probabilities.
fn assert_alike(a: &Imm, b: &Imm, tolerance: f64) {
    let (m, n) = (a.moments(), b.moments());
    let (p, q) = (kinematic(&m), kinematic(&n));
    let [x, y] = std::array::from_fn(|i| (m.position[i] - n.position[i]).abs());
    let [vx, vy] = std::array::from_fn(|i| (m.velocity[i] - n.velocity[i]).abs());
    for (i, difference) in [x, y, vx, vy].into_iter().enumerate() {
        assert!(difference < tolerance * libm::sqrt(p[(i, i)]), "component {i}: {m:?} {n:?}");
        assert!((p[(i, i)] / q[(i, i)] - 1.0).abs() < tolerance, "variance {i}: {m:?} {n:?}");
    }
    assert!(angle_difference(m.yaw, n.yaw).abs() < tolerance * libm::sqrt(m.yaw_variance));
    assert!((m.yaw_variance / n.yaw_variance - 1.0).abs() < tolerance, "{m:?} {n:?}");
    for (p, q) in m.model_probabilities.into_iter().zip(n.model_probabilities) {
        assert!((p - q).abs() < 1e-9, "{m:?} {n:?}");
    }
}

#[test]
fn a_split_step_is_the_whole_step() {
    // A stop within a step is modelled at its beginning: 0.4 % of the mixture are then 2 m apart.
    for (dt, tolerance) in [(0.05, 0.02), (0.1, 0.04), (0.5, 0.4)] {
        for (speed, turn_rate) in [(0.0, 0.0), (8.0, 0.0), (8.0, 0.3), (15.0, -0.2)] {
            for parts in [2, 5, 50] {
                let mut whole = driven(speed, turn_rate, 0.7);
                let mut split = whole;
                whole.predict(dt, Class::Car, CAR_LENGTH_M);
                for _ in 0..parts {
                    split.predict(dt / f64::from(parts), Class::Car, CAR_LENGTH_M);
                }
                assert_alike(&whole, &split, tolerance);
            }
        }
    }
}

#[test]
fn prediction_forth_and_back_returns_the_mean_with_a_larger_covariance() {
    let start = driven(8.0, 0.1, -2.0);
    let mut there_and_back = start;
    there_and_back.predict(-0.1, Class::Car, CAR_LENGTH_M);
    let earlier = there_and_back.moments();
    let before = start.moments();
    assert!((earlier.position[0] - before.position[0] + 0.1 * before.velocity[0]).abs() < 0.05);
    there_and_back.predict(0.1, Class::Car, CAR_LENGTH_M);
    let after = there_and_back.moments();
    for axis in 0..2 {
        assert!((after.position[axis] - before.position[axis]).abs() < 0.05);
    }
    let (p, q) = (kinematic(&before), kinematic(&after));
    for i in 0..4 {
        assert!(q[(i, i)] > p[(i, i)]);
    }
    assert!(after.yaw_variance > before.yaw_variance);
}

#[test]
fn model_probabilities_separate_standing_from_moving_objects() {
    let [parked, stopped, ..] = driven(0.0, 0.0, 1.0).model_probabilities();
    assert!(parked + stopped > 0.95);
    let moving = driven(8.0, 0.0, 1.0);
    assert!(moving.model_probabilities()[SMOOTH] > 0.8);
    let [vx, vy] = moving.moments().velocity;
    assert!((vx - 8.0 * libm::cos(1.0)).abs() < 0.2 && (vy - 8.0 * libm::sin(1.0)).abs() < 0.2);
    assert!(driven(10.0, 0.5, 0.0).model_probabilities()[MANOEUVRE] > 0.5);
}

#[test]
fn a_fast_car_stays_in_the_gate() {
    let mut imm = Imm::initial(&report([0.0, 0.0], 0.0));
    for step in 1..20 {
        imm.predict(0.1, Class::Car, CAR_LENGTH_M);
        let z = report([3.0 * f64::from(step), 0.0], 0.0);
        // The gate of the association: chi-squared with 2 degrees of freedom at 0.9997.
        let place = imm.place();
        let off = [z.position[0] - place.position[0], z.position[1] - place.position[1]];
        let s = Covariance2::from(Symmetric::from(place.gate_covariance).plus(&z.r.into()));
        let distance2 = PositionInnovation::new(off, &s).mahalanobis2;
        assert!(distance2 < 16.2, "step {step}: {distance2}");
        imm.update(&z, Inflation::NONE);
    }
    assert!((imm.moments().velocity[0] - 30.0).abs() < 0.5, "{:?}", imm.moments());
}

#[test]
fn an_innovation_is_from_the_mixture_to_the_position() {
    let imm = Imm::initial(&report([3.0, -4.0], 0.0));
    // The variances of state and report are 0.09 m² each.
    let innovation = imm.innovation([3.3, -3.4], &Covariance2::isotropic(0.3));
    assert!((innovation.mahalanobis2 - (0.09 + 0.36) / 0.18).abs() < 1e-9, "{innovation:?}");
}

#[test]
fn a_vehicle_turns_about_its_rear_axle_and_a_pedestrian_about_its_centre() {
    let car = Imm::initial(&report([0.0, 0.0], 0.0));
    assert!((car.lever_m - 0.27 * CAR_LENGTH_M).abs() < 1e-12);
    let walker = Measurement { class: Class::Adult, ..report([0.0, 0.0], 0.0) };
    assert_eq!(Imm::initial(&walker).lever_m, 0.0);
}

#[test]
fn the_turn_rate_is_that_of_the_mixture_of_which_one_model_turns() {
    let mut imm = driven(8.0, 0.3, 0.7);
    imm.weights = [0.1, 0.2, 0.3, 0.4];
    imm.manoeuvre.mean[gaussian::TURN] = 0.3;
    imm.manoeuvre.covariance[at(gaussian::TURN, gaussian::TURN)] = 0.04;
    let (motion, moments) = (imm.motion(), imm.moments());
    assert!((motion.turn_rate - 0.4 * 0.3).abs() < 1e-12);
    let second = 0.4 * (0.04 + 0.3 * 0.3);
    assert!((motion.turn_rate_variance - (second - motion.turn_rate * motion.turn_rate)).abs() < 1e-12);
    let [_, _, x_vx, x_vy, _, y_vx, y_vy, ..] = moments.covariance;
    let symmetric = Covariance2 { xx: x_vx, xy: 0.5 * (x_vy + y_vx), yy: y_vy };
    assert!((motion.with_position.xy - symmetric.xy).abs() < 1e-12 && x_vy != y_vx);
    assert_eq!((motion.with_position.xx, motion.with_position.yy), (symmetric.xx, symmetric.yy));
}

#[test]
fn the_neighbourhood_is_about_the_manoeuvring_model() {
    let imm = driven(8.0, 0.3, 0.7);
    let (at, sigma_m) = imm.neighbourhood();
    assert_eq!(at, [imm.manoeuvre.mean[0], imm.manoeuvre.mean[1]]);
    assert!(sigma_m > 0.0);
}

#[test]
fn a_model_that_explains_nothing_is_given_up_and_an_unlikely_one_is_kept() {
    let mut imm = driven(0.0, 0.0, 0.0);
    // What all have in common does not matter: the densities are 1e10 times those of a unit covariance.
    let alike = Likelihood { mahalanobis2: 0.0, determinant: 1e-20 };
    let [mut far, mut off] = [[alike; 4]; 2];
    (far[SMOOTH].mahalanobis2, off[SMOOTH].mahalanobis2) = (80.0, 10.0);
    imm.weights = [0.25; 4];
    let mut kept = imm;
    imm.weigh(&far);
    kept.weigh(&off);
    assert_eq!(imm.weights[SMOOTH], 0.0);
    assert!((kept.weights[SMOOTH] / kept.weights[PARKED] - libm::exp(-5.0)).abs() < 1e-12);
    assert!((imm.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
}

#[test]
fn a_cone_stays_parked() {
    let cone = Measurement { class: Class::TrafficCone, ..report([3.0, 4.0], 0.0) };
    let mut imm = Imm::initial(&cone);
    for _ in 0..10 {
        imm.predict(0.5, Class::TrafficCone, 0.4);
        imm.update(&cone, Inflation::NONE);
    }
    assert_eq!(imm.model_probabilities(), [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(imm.moments().velocity, [0.0, 0.0]);
}

#[test]
fn a_measured_velocity_gives_the_initial_speed() {
    let velocity = Some(Velocity { x: -12.0, y: 0.0, covariance: Covariance2::isotropic(0.3) });
    let imm = Imm::initial(&Measurement { velocity, ..report([0.0, 0.0], PI - 0.01) });
    let [vx, vy] = imm.moments().velocity;
    assert!((vx + 12.0).abs() < 0.5 && vy.abs() < 0.5, "{vx} {vy}");
    assert!(imm.model_probabilities()[PARKED] < 1e-3);
    let zero = Some(Velocity { x: 0.0, y: 0.0, covariance: Covariance2::isotropic(0.1) });
    let still = Imm::initial(&Measurement { velocity: zero, ..report([0.0, 0.0], 0.0) });
    assert!(still.model_probabilities()[PARKED] + still.model_probabilities()[STOPPED] > 0.95);
}

#[test]
fn results_do_not_depend_on_the_map_frame() {
    let far = [9e7, -9e7];
    let turn = PI - 0.05;
    let (sin, cos) = libm::sincos(turn);
    let mut near = Imm::initial(&report([0.0, 0.0], 0.0));
    let mut moved = Imm::initial(&report(far, turn));
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for step in 1..100 {
        let dt = between(&mut random, -0.02, 0.1);
        let ahead = 0.3 * f64::from(step) + between(&mut random, -0.3, 0.3);
        let left = between(&mut random, -0.3, 0.3);
        let yaw = between(&mut random, -0.2, 0.2);
        for imm in [&mut near, &mut moved] {
            imm.predict(dt, Class::Car, CAR_LENGTH_M);
        }
        near.update(&report([ahead, left], yaw), Inflation::NONE);
        let there = [far[0] + ahead * cos - left * sin, far[1] + ahead * sin + left * cos];
        moved.update(&report(there, turn + yaw), Inflation::NONE);
    }
    let (a, b) = (near.moments(), moved.moments());
    let [ahead, left] = a.position;
    // 1e8 m in f64 are known to 1.5e-8 m, a hundred steps add up.
    assert!((far[0] + ahead * cos - left * sin - b.position[0]).abs() < 1e-5);
    assert!((far[1] + ahead * sin + left * cos - b.position[1]).abs() < 1e-5);
    assert!(angle_difference(b.yaw, turn + a.yaw).abs() < 1e-6);
    for (p, q) in a.model_probabilities.into_iter().zip(b.model_probabilities) {
        assert!((p - q).abs() < 1e-5, "{a:?} {b:?}");
    }
}

#[test]
fn inflating_both_sides_is_covariance_intersection() {
    let prior = Imm::initial(&Measurement { class: Class::Barrier, ..report([0.0, 0.0], 0.0) });
    let mut fused = prior;
    fused.update(&report([0.0, 0.0], 0.0), Inflation { prior: 2.0, report: 2.0 });
    // The same report twice, in equal shares: no information is added.
    let (p, q) = (prior.moments(), fused.moments());
    assert!((p.covariance[0] - q.covariance[0]).abs() < 1e-12);
    assert!((p.yaw_variance - q.yaw_variance).abs() < 1e-12);
}

/// Any measurement that the wire accepts: 1 mm to 70 m, 1e-4 to 7 rad, positions anywhere on it.
pub(super) fn anything(random: &mut ChaCha8Rng, near: [f64; 2]) -> Measurement {
    let mut power = |low: f64, high: f64| libm::exp(between(random, libm::log(low), libm::log(high)));
    let (sx, sy, sigma_yaw, sigma_v) =
        (power(1e-3, 70.0), power(1e-3, 70.0), power(1e-4, 7.0), power(1e-3, 70.0));
    let rho = between(random, -0.999, 0.999);
    let position = if random.next_u32().is_multiple_of(200) {
        [between(random, -1e8, 1e8), between(random, -1e8, 1e8)]
    } else {
        near.map(|at| at + between(random, -20.0, 20.0))
    };
    let velocity = random.next_u32().is_multiple_of(3).then(|| Velocity {
        x: between(random, -150.0, 150.0),
        y: between(random, -150.0, 150.0),
        covariance: Covariance2::isotropic(sigma_v),
    });
    Measurement {
        class: Class::ALL[random.next_u32() as usize % Class::ALL.len()],
        position,
        r: Covariance2 { xx: sx * sx, xy: rho * sx * sy, yy: sy * sy },
        size: [2.0, 60.0],
        relative_variance: [0.04; 2],
        yaw: between(random, -PI, PI),
        yaw_variance: sigma_yaw * sigma_yaw,
        size_law: [None; 2],
        heading: v2x_common::detection::HeadingKind::Known,
        velocity,
        is_track: false,
        since_last_s: f64::INFINITY,
    }
}

#[test]
fn a_million_arbitrary_measurements_keep_covariances_positive_definite() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut imm = Imm::initial(&anything(&mut random, [0.0, 0.0]));
    for step in 0..1_000_000 {
        if step % 100 == 0 {
            let near = imm.moments().position;
            imm = Imm::initial(&anything(&mut random, near.map(|at| at.clamp(-1e8, 1e8))));
        }
        let z = anything(&mut random, imm.moments().position);
        let dt = if random.next_u32().is_multiple_of(3) { 0.0 } else { between(&mut random, -0.5, 1.0) };
        imm.predict(dt, z.class, z.size[1]);
        let inflation = if random.next_u32().is_multiple_of(4) {
            Inflation { prior: 2.5, report: 1.0 / 0.6 }
        } else {
            Inflation::NONE
        };
        let innovation = imm.update(&z, inflation);
        assert!(innovation.mahalanobis2 >= 0.0 && innovation.determinant > 0.0, "{innovation:?}");
        if step % 50 == 0 {
            assert_sound(&imm);
        }
    }
}
