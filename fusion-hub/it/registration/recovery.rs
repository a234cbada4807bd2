//! Clock and pose errors are corrected, and the estimate's covariance is consistent.

use super::traffic::{DEGREE, EXACT, Observer, Path, Traffic, VEHICLE, normal, rings, straights};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use v2x_fusion_hub::registration::{Bias, MEMORY_S, Registration};

const SEEDS: u64 = 10;

/// One surveyed unit, and a vehicle with errors.
fn pair(registration: Registration, bias: Bias, objects: Vec<Path>, seed: u64) -> Traffic {
    Traffic::new(registration, objects, vec![Observer::unit(), Observer::vehicle("car", bias)], seed)
}

/// Mean over seeds of the root mean square error from 15 s to 20 s, and of what of the bias is left at 20 s.
fn after_20_s(registration: Registration, bias: Bias, objects: fn(u64) -> Vec<Path>) -> (f64, [f64; 4]) {
    let (mut rmse_m, mut left) = (0.0, [0.0; 4]);
    for seed in 0..SEEDS {
        let mut traffic = pair(registration, bias, objects(seed), seed);
        traffic.run(15).rmse_m();
        rmse_m += traffic.run(5).rmse_m() / SEEDS as f64;
        if registration == Registration::Off {
            continue;
        }
        let applied = traffic.registration_of("car").applied.to_array();
        for (left, (bias, applied)) in left.iter_mut().zip(bias.to_array().into_iter().zip(applied)) {
            *left += (bias - applied) / SEEDS as f64;
        }
    }
    (rmse_m, left)
}

#[test]
fn correction_removes_four_fifths_of_the_cost_of_a_bias_within_20_s() {
    let cases = [
        Bias { clock_s: 0.05, ..Bias::ZERO },
        Bias { clock_s: -0.05, ..Bias::ZERO },
        Bias { dx_m: 0.3, dy_m: -0.4, ..Bias::ZERO },
        Bias { yaw_rad: -0.5 * DEGREE, ..Bias::ZERO },
        Bias { dx_m: -0.4, dy_m: 0.3, yaw_rad: 0.5 * DEGREE, clock_s: 0.05 },
    ];
    for objects in [rings, straights] {
        let (unbiased_m, _) = after_20_s(Registration::Off, Bias::ZERO, objects);
        for bias in cases {
            let (lost_m, _) = after_20_s(Registration::Off, bias, objects);
            let (kept_m, left) = after_20_s(Registration::Correct, bias, objects);
            let recovered = (lost_m - kept_m) / (lost_m - unbiased_m);
            assert!(recovered >= 0.8, "{recovered:.2} of {bias:?}: {unbiased_m:.3} {lost_m:.3} {kept_m:.3}");
            let [x, y, yaw, clock] = left;
            let of_declared = [
                libm::hypot(x, y) / VEHICLE.position_m,
                yaw.abs() / VEHICLE.yaw_rad,
                clock.abs() / VEHICLE.clock_s,
            ];
            println!(
                "{bias:?}: {recovered:.2} recovered; left of declared {of_declared:.2?}; rmse {unbiased_m:.3} {lost_m:.3} {kept_m:.3}"
            );
            assert!(of_declared.iter().all(|share| *share <= 0.2), "{of_declared:?} of {bias:?} left");
        }
    }
}

/// With errors drawn from the model that is assumed, the normalised error squared has the mean of its χ².
#[test]
fn the_covariance_is_consistent_where_errors_drift_as_assumed() {
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..3 * SEEDS {
        let mut traffic = pair(Registration::Estimate, Bias::ZERO, rings(seed), seed);
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        let sigmas = [VEHICLE.position_m, VEHICLE.position_m, VEHICLE.yaw_rad, VEHICLE.clock_s];
        let mut bias = sigmas.map(|sigma| sigma * normal(&mut rng));
        let kept = libm::exp(-1.0 / MEMORY_S);
        for second in 0..40 {
            traffic.observers[1].bias = Bias::from_array(bias);
            traffic.run(1);
            if second >= 10 && second % 5 == 0 {
                let registered = traffic.registration_of("car");
                let estimate = registered.bias.to_array();
                let error: [f64; 4] = std::array::from_fn(|k| (estimate[k] - bias[k]) / sigmas[k]);
                let scaled = |row: usize, column: usize| {
                    registered.covariance[row][column] / (sigmas[row] * sigmas[column])
                };
                let covariance = nalgebra::Matrix4::from_fn(scaled);
                let inverse = covariance.try_inverse().expect("positive definite");
                let error = nalgebra::Vector4::from(error);
                sum += (error.transpose() * inverse * error)[0];
                count += 4.0;
            }
            let fresh = libm::sqrt(1.0 - kept * kept);
            bias = std::array::from_fn(|k| kept * bias[k] + fresh * sigmas[k] * normal(&mut rng));
        }
    }
    let nees = sum / count;
    println!("NEES {nees:.2} of {count} degrees of freedom");
    // Errors of one run last for seconds, so that there are fewer draws than counted.
    assert!((0.6..1.4).contains(&nees), "{nees}");
}

#[test]
fn late_frames_in_another_order_give_the_same_accuracy() {
    for seed in 0..5 {
        let bias = Bias { dx_m: 0.4, dy_m: 0.3, yaw_rad: 0.0, clock_s: 0.05 };
        let car = Observer { delay_ms: (250, 120), ..Observer::vehicle("car", bias) };
        let observers = vec![Observer::unit(), car];
        let mut traffic = Traffic::new(Registration::Correct, straights(seed), observers, seed);
        let registered = traffic.run(15).registration_of("car");
        assert!(registered.pairs > 400, "{registered:?}");
        let (applied, expected) = (registered.applied.to_array(), bias.to_array());
        let off = |k: usize| (applied[k] - expected[k]).abs();
        assert!(off(0).max(off(1)) < 0.25 && off(3) < 0.02, "{registered:?}");
    }
}

#[test]
fn an_error_beyond_the_declared_one_is_published_and_corrected_up_to_it() {
    let bias = Bias { dx_m: 1.2, ..Bias::ZERO };
    let mut traffic = pair(Registration::Correct, bias, rings(1), 1);
    let registered = traffic.run(20).registration_of("car");
    assert!(registered.exceeds_declared && registered.bias.dx_m > 0.9, "{registered:?}");
    assert!(
        (libm::hypot(registered.applied.dx_m, registered.applied.dy_m) - VEHICLE.position_m).abs() < 1e-9,
        "{registered:?}"
    );
}

#[test]
fn an_agent_that_declares_no_error_of_its_clock_has_none() {
    let accuracy = v2x_common::sensor::Accuracy { clock_s: 0.0, ..VEHICLE };
    let car = Observer { accuracy, ..Observer::vehicle("car", Bias { dy_m: 0.5, ..Bias::ZERO }) };
    let mut traffic = Traffic::new(Registration::Correct, rings(2), vec![Observer::unit(), car], 2);
    let registered = traffic.run(20).registration_of("car");
    assert_eq!(
        (registered.bias.clock_s, registered.sigma.clock_s, registered.observable.clock),
        (0.0, 0.0, false)
    );
    assert!((registered.applied.dy_m - 0.5).abs() < 0.2, "{registered:?}");
}

#[test]
fn an_agent_that_shares_objects_with_no_reference_is_measured_through_one_that_does() {
    // The unit covers the rings, `far` the objects parked a hundred metres away, `mid` both.
    let parked =
        (0..6_u32).map(|k| Path::Fixed([100.0 + 8.0 * f64::from(k), 15.0 * f64::from(k % 3) - 15.0]));
    let objects: Vec<Path> = rings(3).into_iter().take(3).chain(parked).collect();
    let unit = Observer { range_m: 70.0, ..Observer::unit() };
    let mid = Observer { path: Path::Fixed([60.0, 0.0]), ..Observer::vehicle("mid", Bias::ZERO) };
    let bias = Bias { dy_m: 0.6, ..Bias::ZERO };
    let far = Observer { path: Path::Fixed([130.0, 0.0]), range_m: 60.0, ..Observer::vehicle("far", bias) };
    let mut traffic =
        Traffic::new(Registration::Correct, objects.clone(), vec![unit, mid.clone(), far.clone()], 3);
    let registered = traffic.run(30).registration_of("far");
    assert!(!registered.relative_only && registered.observable.position, "{registered:?}");
    assert!((registered.bias.dy_m - 0.6).abs() < 3.0 * registered.sigma.dy_m, "{registered:?}");
    let mut alone = Traffic::new(Registration::Correct, objects, vec![mid, far], 3);
    let relative = alone.run(30).registration_of("far");
    assert!(relative.relative_only && relative.sigma.dy_m > 1.5 * registered.sigma.dy_m, "{relative:?}");
}

#[test]
fn without_data_the_estimate_returns_to_what_was_declared() {
    let bias = Bias { dx_m: 0.5, ..Bias::ZERO };
    let mut traffic = pair(Registration::Correct, bias, rings(4), 4);
    assert!(traffic.run(15).registration_of("car").applied.dx_m > 0.3);
    traffic.objects.clear();
    let registered = traffic.run(120).registration_of("car");
    assert_eq!(registered.applied, Bias::ZERO, "{registered:?}");
    assert!(registered.sigma.dx_m > 0.9 * VEHICLE.position_m, "{registered:?}");
    assert_eq!(traffic.observers[1].white, EXACT);
}
