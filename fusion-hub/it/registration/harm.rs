//! Without errors or without a reference no frame is corrected.

use super::traffic::{DEGREE, EXACT, Observer, Path, SURVEYED, Traffic, VEHICLE, normal, rings};
use crate::world::config;
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use v2x_common::fused::FusedObject;
use v2x_common::sensor::Accuracy;
use v2x_common::time::Span;
use v2x_fusion_hub::engine::{Disposition, Refusal};
use v2x_fusion_hub::fusion::{Hypotheses, MotionModel, ParticleCount};
use v2x_fusion_hub::registration::{Bias, Registration};

const ALL: Bias = Bias { dx_m: 0.3, dy_m: -0.4, yaw_rad: 0.5 * DEGREE, clock_s: 0.05 };

fn both(bias: Bias) -> Vec<Observer> {
    vec![Observer::unit(), Observer::vehicle("car", bias)]
}

/// The objects published at every tenth of a second.
fn published(
    registration: Registration,
    objects: Vec<Path>,
    observers: Vec<Observer>,
) -> Vec<Vec<FusedObject>> {
    let mut traffic = Traffic::new(registration, objects, observers, 5);
    let mut lists = Vec::new();
    for _ in 0..20 {
        traffic.run(1);
        lists.push(traffic.published().to_vec());
    }
    lists
}

#[test]
fn an_agent_without_error_is_not_corrected() {
    for seed in 0..20 {
        let mut traffic = Traffic::new(Registration::Correct, rings(seed), both(Bias::ZERO), seed);
        for second in 0..60 {
            let registered = traffic.run(1).registration_of("car");
            assert_eq!(registered.applied, Bias::ZERO, "second {second} of seed {seed}: {registered:?}");
            assert!(
                !registered.exceeds_declared && !registered.relative_only && !registered.confounded,
                "{registered:?}"
            );
        }
    }
}

#[test]
fn an_estimate_alone_changes_no_bit() {
    let [off, estimate, correct] = [Registration::Off, Registration::Estimate, Registration::Correct]
        .map(|registration| published(registration, rings(5), both(ALL)));
    assert_eq!(off, estimate);
    assert_ne!(off, correct);
}

#[test]
fn without_a_reference_only_differences_are_estimated_and_no_frame_is_corrected() {
    let vehicles = || vec![Observer::vehicle("a", Bias::ZERO), Observer::vehicle("b", ALL)];
    let mut traffic = Traffic::new(Registration::Correct, rings(6), vehicles(), 6);
    traffic.run(30);
    for name in ["a", "b"] {
        let registered = traffic.registration_of(name);
        assert!(registered.relative_only && registered.pairs > 500, "{registered:?}");
        assert_eq!(registered.applied, Bias::ZERO);
        // Each may be half of it.
        assert!(registered.sigma.dx_m > 0.6 * VEHICLE.position_m, "{registered:?}");
    }
    assert_eq!(
        published(Registration::Off, rings(5), vehicles()),
        published(Registration::Correct, rings(5), vehicles())
    );
}

#[test]
fn objects_of_one_agent_alone_give_no_estimate() {
    let far = Path::Fixed([500.0, 0.0]);
    let observers = || {
        let unit = Observer { range_m: 120.0, ..Observer::unit() };
        vec![unit, Observer { path: far, range_m: 120.0, ..Observer::vehicle("car", ALL) }]
    };
    let objects = || {
        let parked = (0..6).map(|k| Path::Fixed([470.0 + 12.0 * f64::from(k), 20.0]));
        rings(7).into_iter().chain(parked).collect::<Vec<_>>()
    };
    let mut traffic = Traffic::new(Registration::Correct, objects(), observers(), 7);
    let one = traffic.run(10).registration_of("car");
    assert_eq!((one.pairs, one.bias, one.relative_only), (0, Bias::ZERO, false));
    assert_eq!(
        published(Registration::Off, objects(), observers()),
        published(Registration::Correct, objects(), observers())
    );
}

fn platoon(speed_mps: impl Fn(u32) -> f64) -> Vec<Path> {
    let lane = |k: u32| [-100.0 + 15.0 * f64::from(k), 12.0 * f64::from(k) - 30.0];
    (0..6).map(|k| Path::Straight { start: lane(k), yaw: 0.0, speed_mps: speed_mps(k) }).collect()
}

#[test]
fn where_all_objects_move_alike_clock_and_position_are_one_error_and_neither_is_corrected() {
    let late = Bias { clock_s: 0.05, ..Bias::ZERO };
    let standing = |bias| {
        let path = Path::Fixed([0.0, -40.0]);
        vec![Observer::unit(), Observer { path, ..Observer::vehicle("car", bias) }]
    };
    let mut traffic = Traffic::new(Registration::Correct, platoon(|_| 10.0), standing(late), 8);
    let alike = traffic.run(15).registration_of("car");
    assert!(alike.confounded && !alike.observable.clock && !alike.observable.position, "{alike:?}");
    assert_eq!(alike.applied, Bias::ZERO);
    let mut traffic = Traffic::new(Registration::Correct, platoon(|k| 3.0 * f64::from(k)), standing(late), 8);
    let unlike = traffic.run(15).registration_of("car");
    assert!(!unlike.confounded && unlike.observable.clock, "{unlike:?}");
    assert!((unlike.applied.clock_s - 0.05).abs() < 0.015, "{unlike:?}");
}

#[test]
fn per_frame_errors_do_not_grow_by_correction() {
    let white = Accuracy { clock_s: 0.0, ..VEHICLE };
    let [mut off, mut correct] = [0.0; 2];
    for seed in 0..10 {
        for (registration, sum) in [(Registration::Off, &mut off), (Registration::Correct, &mut correct)] {
            let car = Observer { white, ..Observer::vehicle("car", Bias::ZERO) };
            let mut traffic = Traffic::new(registration, rings(seed), vec![Observer::unit(), car], seed);
            *sum += traffic.run(30).rmse_m();
            if registration == Registration::Correct {
                let registered = traffic.registration_of("car");
                assert!((0.3..1.5).contains(&registered.white_share), "{registered:?}");
            }
        }
    }
    println!("white noise: {:.4} with, {:.4} without", correct / 10.0, off / 10.0);
    assert!(correct < 1.01 * off, "{correct} for {off}");
}

#[test]
fn admission_uses_the_corrected_time_and_keeps_ids_and_stamps() {
    let late = Bias { clock_s: 0.05, ..Bias::ZERO };
    let mut traffic = Traffic::new(Registration::Correct, rings(9), both(late), 9);
    traffic.run(20);
    assert!(traffic.registration_of("car").applied.clock_s > 0.03);
    let (frame, _) = traffic.frame(1);
    // By its own stamp it is 530 ms ahead of the hub; corrected, within Δmax.
    let now = frame.captured_at - Span::from_millis(530);
    let latest = traffic.latest_now();
    let shifted =
        v2x_common::detection::DetectionFrame { captured_at: frame.captured_at + (latest - now), ..frame };
    assert_eq!(
        traffic.engine.handle_frame(&shifted, latest),
        Disposition::Accepted { out_of_sequence: false }
    );
    let again = traffic.engine.handle_frame(&shifted, latest);
    assert!(matches!(again, Disposition::Refused(Refusal::Duplicate { .. })), "{again:?}");
    let includes = &traffic.engine.fused(latest).includes;
    let named = includes.iter().find(|one| one.frame == shifted.id).expect("it was accepted");
    assert_eq!(named.captured_at, shifted.captured_at);
}

#[test]
fn an_absurd_declaration_keeps_all_estimates_finite() {
    let absurd = Accuracy { position_m: 1e300, yaw_rad: f64::MAX, clock_s: f64::MAX };
    let extreme = Observer { accuracy: absurd, ..Observer::vehicle("extreme", ALL) };
    let observers = vec![Observer::unit(), extreme, Observer::vehicle("car", Bias::ZERO)];
    let mut traffic = Traffic::new(Registration::Correct, rings(10), observers, 10);
    traffic.run(10);
    let car = traffic.registration_of("car");
    assert!(car.observable.position && car.applied == Bias::ZERO, "{car:?}");
    let extreme = traffic.registration_of("extreme");
    assert!((extreme.bias.clock_s - ALL.clock_s).abs() < 3.0 * extreme.sigma.clock_s, "{extreme:?}");
    assert!(extreme.sigma.dx_m < 0.5, "{extreme:?}");
}

fn assert_within_declared(traffic: &Traffic) {
    for observer in &traffic.observers {
        let (registered, declared) = (traffic.registration_of(observer.name), observer.accuracy);
        let Bias { dx_m, dy_m, yaw_rad, clock_s } = registered.applied;
        assert!(libm::hypot(dx_m, dy_m) <= declared.position_m + 1e-12, "{registered:?}");
        assert!(yaw_rad.abs() <= declared.yaw_rad && clock_s.abs() <= declared.clock_s, "{registered:?}");
        assert!(!registered.is_reference || registered.applied == Bias::ZERO, "{registered:?}");
    }
}

fn biases(scale: f64) -> impl Strategy<Value = Bias> {
    prop::array::uniform4(-scale..scale).prop_map(|[dx_m, dy_m, yaw, clock]| Bias {
        dx_m,
        dy_m,
        yaw_rad: yaw * DEGREE,
        clock_s: 0.1 * clock,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn no_agent_is_corrected_by_more_than_it_declares(
        unit in biases(3.0), other in biases(3.0), seed in 0..1000_u64, is_unit_there: bool
    ) {
        let mut observers = vec![Observer::vehicle("good", Bias::ZERO), Observer::vehicle("other", other)];
        if is_unit_there {
            // A reference that was surveyed wrongly.
            observers.push(Observer { bias: unit, accuracy: SURVEYED, white: EXACT, ..Observer::unit() });
        }
        let mut traffic = Traffic::new(Registration::Correct, rings(seed), observers, seed);
        for _ in 0..24 {
            traffic.run(1);
            assert_within_declared(&traffic);
        }
    }
}

/// Root mean square error where the vehicle errs by as much as it declares, for this long in the same way.
fn with_drift(registration: Registration, correlated_s: f64, seed: u64) -> f64 {
    let traffic = Traffic::new(registration, rings(seed), both(Bias::ZERO), seed);
    drifted(traffic, correlated_s, seed)
}

/// The same of a vehicle that says nothing of its accuracy.
fn with_undeclared_drift(correlated_s: f64, seed: u64) -> f64 {
    let mut observers = both(Bias::ZERO);
    observers[1].accuracy = EXACT;
    drifted(Traffic::new(Registration::Off, rings(seed), observers, seed), correlated_s, seed)
}

fn without_vehicle(seed: u64) -> f64 {
    let mut traffic = Traffic::new(Registration::Off, rings(seed), vec![Observer::unit()], seed);
    traffic.run(30).rmse_m()
}

fn drifted(mut traffic: Traffic, correlated_s: f64, seed: u64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(99 + seed);
    let sigmas = [VEHICLE.position_m, VEHICLE.position_m, VEHICLE.yaw_rad, VEHICLE.clock_s];
    let mut bias = sigmas.map(|sigma| sigma * normal(&mut rng));
    let kept = libm::exp(-0.1 / correlated_s);
    let fresh = libm::sqrt(1.0 - kept * kept);
    for _ in 0..300 {
        traffic.observers[1].bias = Bias::from_array(bias);
        traffic.step_once();
        traffic.score();
        bias = std::array::from_fn(|k| kept * bias[k] + fresh * sigmas[k] * normal(&mut rng));
    }
    traffic.rmse_m()
}

#[test]
fn a_pose_that_drifts_costs_nothing_against_a_hub_without_the_agent_and_slow_drifts_are_corrected() {
    let mean = |error: &dyn Fn(u64) -> f64| (0..6).map(error).sum::<f64>() / 6.0;
    let alone = mean(&without_vehicle);
    // s, and how much of the error of the other agent alone may be left with correction.
    for (correlated_s, share) in [(0.3, 0.98), (3.0, 0.95), (30.0, 0.88)] {
        let with = |registration| mean(&|seed| with_drift(registration, correlated_s, seed));
        let [off, correct] = [Registration::Off, Registration::Correct].map(with);
        let undeclared = mean(&|seed| with_undeclared_drift(correlated_s, seed));
        let all =
            format!("{correct}, {off} uncorrected, {undeclared} undeclared, {alone} alone, {correlated_s} s");
        assert!(correct < share * alone && off < alone && alone < undeclared, "{all}");
    }
}

#[test]
fn the_rate_of_publishing_changes_no_estimate() {
    let run = |publishes: bool| {
        let mut traffic = Traffic::new(Registration::Correct, rings(11), both(ALL), 11);
        for _ in 0..150 {
            traffic.step_once();
            if publishes {
                traffic.published();
            }
        }
        (traffic.registration_of("car"), traffic.published().to_vec())
    };
    let (often, seldom) = (run(true), run(false));
    assert_ne!(often.0.applied, Bias::ZERO);
    assert_eq!(often, seldom);
}

#[test]
fn errors_are_corrected_with_a_lag_and_with_several_hypotheses() {
    let hypotheses = |hypotheses| config().with_tracking(|tracking| tracking.tracker.hypotheses = hypotheses);
    let lag = hypotheses(Hypotheses::with_lag(Span::from_millis(300)));
    let particles = hypotheses(Hypotheses::Particles(ParticleCount::new(8).unwrap()));
    let paper_motion = config().with_tracking(|tracking| tracking.motion = MotionModel::Cv);
    for config in [lag, particles, paper_motion] {
        let mut traffic = Traffic::with_config(config, rings(12), both(ALL), 12);
        let registered = traffic.run(15).registration_of("car");
        assert!((registered.applied.clock_s - ALL.clock_s).abs() < 0.02, "{registered:?}");
        assert!((registered.applied.dy_m - ALL.dy_m).abs() < 0.25, "{registered:?}");
    }
}
