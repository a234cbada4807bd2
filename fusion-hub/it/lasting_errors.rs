//! Errors that last for seconds: of positions, of headings, and of an agent's pose, with nothing declared.

use crate::consistency::normal;
use crate::world::{agent, at, frame};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, HeadingKind};
use v2x_common::geometry::BevBox;
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Engine, EngineConfig};
use v2x_fusion_hub::learning::LearntSensorReport;

/// Parked cars, m.
const PARKED: [[f64; 2]; 6] =
    [[12.0, 0.0], [-14.0, 6.0], [20.0, 15.0], [5.0, -22.0], [-25.0, -10.0], [30.0, -4.0]];

fn engine() -> Engine {
    Engine::new(EngineConfig::new(HubId::new("hub").expect("test input"), 1))
}

/// White errors of variance 1, of a report and what is reported.
fn white(k: i64, what: i64) -> f64 {
    let seed = (k + 1).unsigned_abs() * 1_000_003 + what.unsigned_abs();
    normal(&mut ChaCha8Rng::seed_from_u64(seed))
}

/// Errors of variance 1 that last: after a step, this share is left.
fn lasting(n: i64, what: i64, share: f64) -> Vec<f64> {
    let mut last = white(-1, what);
    let step = (1.0 - share * share).sqrt();
    (0..n)
        .map(|k| {
            last = share * last + step * white(k, what);
            last
        })
        .collect()
}

/// A report with σ 0.3 m and 0.05 rad.
fn car([x, y]: [f64; 2], yaw: f64) -> Detection {
    Detection {
        class: Class::Car,
        score: 1.0,
        bev: BevBox { x, y, w: 1.8, d: 4.5, yaw: v2x_common::geometry::wrap_angle(yaw) },
        covariance: BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.01, dd: 0.04, yaw: 0.0025 },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

fn learnt(engine: &Engine, name: &str) -> LearntSensorReport {
    engine.learnt(&agent(name)).expect("an agent of whom something is learnt")
}

/// Mean error of parked cars in the last 10 s, m; with an agent whose pose is off by this in each of its frames, or without.
fn parked(n: i64, pose: Option<&[[f64; 2]]>) -> (f64, Engine) {
    let mut engine = engine();
    let (mut sum, mut seen) = (0.0, 0.0);
    for step in 0..n {
        let ms = 100 * step;
        let agents: &[&str] = if pose.is_some() { &["good", "wanders"] } else { &["good"] };
        for (salt, name) in (0..).zip(agents) {
            let off = pose
                .filter(|_| *name != "good")
                .map_or([0.0; 2], |pose| pose[usize::try_from(step).expect("a number")]);
            let reports = (0..).zip(PARKED).map(|(one, [x, y])| {
                let error = |what: i64| 0.3 * white(step, 100 * salt + 10 * one + what);
                car(
                    [x + off[0] + error(3), y + off[1] + error(4)],
                    0.05 * white(step, 100 * salt + 10 * one + 5),
                )
            });
            engine.handle_frame(&frame(agent(name), step.unsigned_abs(), ms, reports.collect()), at(ms + 30));
        }
        if step >= n - 100 {
            for object in &engine.fused(at(ms + 40)).objects {
                let away = PARKED.iter().map(|[x, y]| libm::hypot(object.bev.x - x, object.bev.y - y));
                sum += away.fold(f64::INFINITY, f64::min);
                seen += 1.0;
            }
        }
    }
    assert!(seen > 0.98 * 100.0 * PARKED.len() as f64, "objects are missing: {seen}");
    (sum / seen, engine)
}

#[test]
fn an_agent_whose_pose_wanders_by_a_metre_and_who_does_not_say_so_spoils_nothing() {
    let (alone, _) = parked(300, None);
    for seed in [1, 1011, 1021, 1031, 1041] {
        let pose: Vec<_> = lasting(300, seed, 0.98)
            .into_iter()
            .zip(lasting(300, seed + 1, 0.98))
            .map(<[f64; 2]>::from)
            .collect();
        let (both, engine) = parked(300, Some(&pose));
        assert!(both < alone + 0.05, "{seed}: {both} m with it, {alone} m without");
        let wanders = learnt(&engine, "wanders").pose_sigma_m;
        assert!((0.4..2.0).contains(&wanders), "{seed}: {wanders} m");
        assert_eq!(learnt(&engine, "good").pose_sigma_m, 0.0);
    }
}

#[test]
fn an_agent_whose_pose_swings_slowly_is_found_out_by_what_another_sees_and_that_one_is_not_blamed() {
    let (alone, _) = parked(400, None);
    for period_s in [8.0, 20.0] {
        let turn = |step: i32| 0.1 * f64::from(step) * std::f64::consts::TAU / period_s;
        let pose: Vec<_> =
            (0..400).map(|step| [1.2 * libm::sin(turn(step)), 1.2 * libm::cos(turn(step))]).collect();
        let (both, engine) = parked(400, Some(&pose));
        assert!(both < alone + 0.05, "{period_s} s: {both} m with it, {alone} m without");
        let good = learnt(&engine, "good");
        assert!(good.sigma_factor < 1.5 && good.pose_sigma_m == 0.0, "{period_s} s: {good:?}");
    }
}

/// Mean error of parked cars in the last 10 s of 30, m: a lidar sees them with white errors of 0.3 m, and a camera, if it is there,
/// with errors of 0.6 m that last, which are others for each car.
fn beside_a_lidar(has_camera: bool) -> f64 {
    let mut engine = engine();
    let lasts: Vec<_> = (0..12).map(|what| lasting(300, 200 + what, 0.98)).collect();
    let (mut sum, mut n) = (0.0, 0.0);
    for (k, step) in (0_i64..300).enumerate() {
        let ms = 100 * step;
        for is_camera in [false, true].into_iter().filter(|is_camera| has_camera || !is_camera) {
            let seen = PARKED.iter().enumerate().map(|(one, [x, y])| {
                let salt = 10 * i64::try_from(one).expect("small");
                let [ex, ey] = if is_camera {
                    [0.6 * lasts[2 * one][k], 0.6 * lasts[2 * one + 1][k]]
                } else {
                    [0.3 * white(step, salt + 3), 0.3 * white(step, salt + 4)]
                };
                car([x + ex, y + ey], 0.05 * white(step, salt + 5))
            });
            let (name, late_ms) = if is_camera { ("camera", 50) } else { ("lidar", 0) };
            let sent = frame(agent(name), step.unsigned_abs(), ms + late_ms, seen.collect());
            engine.handle_frame(&sent, at(ms + late_ms + 10));
        }
        if k >= 200 {
            for object in &engine.fused(at(ms + 70)).objects {
                let away = PARKED.iter().map(|[x, y]| libm::hypot(object.bev.x - x, object.bev.y - y));
                sum += away.fold(f64::INFINITY, f64::min);
                n += 1.0;
            }
        }
    }
    assert!(n > 0.98 * 100.0 * PARKED.len() as f64, "objects are missing: {n}");
    sum / n
}

#[test]
fn what_a_lidar_sees_does_not_wander_with_a_cameras_errors() {
    let (alone, both) = (beside_a_lidar(false), beside_a_lidar(true));
    assert!(both < alone + 0.02, "{both} m with the camera, {alone} m without");
}

/// How cars drive on their circles.
struct Drive {
    /// By turns this much faster and slower than 8 m/s.
    swing_mps: f64,
    turn_radps: f64,
}

const WIDE: Drive = Drive { swing_mps: 4.0, turn_radps: 0.1 };
/// A roundabout of 12 m.
const TIGHT: Drive = Drive { swing_mps: 0.0, turn_radps: 0.67 };

/// What is learnt of an agent that reports eight cars at a rate (Hz) for 60 s, whose headings err by a function of report and
/// car, rad: each drives on a circle of its own.
fn driving(rate_hz: i64, drive: &Drive, heading_error: impl Fn(i64, usize) -> f64) -> LearntSensorReport {
    let mut engine = engine();
    let mut cars: Vec<[f64; 3]> = (0..8).map(|one| [40.0 * f64::from(one), 0.0, f64::from(one)]).collect();
    for k in 0..60 * rate_hz {
        let ms = 1000 * k / rate_hz;
        let seen = cars.iter().enumerate().map(|(one, [x, y, yaw])| {
            let error = |what: i64| 0.3 * white(k, 10 * i64::try_from(one).expect("small") + what);
            car([x + error(1), y + error(2)], yaw + heading_error(k, one))
        });
        engine.handle_frame(&frame(agent("lidar"), k.unsigned_abs(), ms, seen.collect()), at(ms + 30));
        engine.fused(at(ms + 40));
        for (one, [x, y, yaw]) in (0..).zip(&mut cars) {
            let (dt_s, t_s) = (1.0 / rate_hz as f64, ms as f64 / 1000.0);
            let speed = 8.0 + drive.swing_mps * libm::sin(0.5 * t_s + f64::from(one));
            let half_turn = dt_s * drive.turn_radps / if one % 2 == 0 { 2.0 } else { -2.0 };
            *x += speed * dt_s * libm::cos(*yaw + half_turn);
            *y += speed * dt_s * libm::sin(*yaw + half_turn);
            *yaw += 2.0 * half_turn;
        }
    }
    learnt(&engine, "lidar")
}

#[test]
fn white_errors_about_cars_that_manoeuvre_are_not_taken_to_last_at_any_rate() {
    let rates = [1, 2, 5, 10].map(|rate_hz| (rate_hz, WIDE));
    for (rate_hz, drive) in rates.into_iter().chain([2, 5, 10].map(|rate_hz| (rate_hz, TIGHT))) {
        let error = |k: i64, one: usize| 0.05 * white(k, 10 * i64::try_from(one).expect("small") + 3);
        let learnt = driving(rate_hz, &drive, error);
        let lasts = [learnt.lasting_sigma_m, learnt.lasting_heading_sigma_deg, learnt.pose_sigma_m];
        assert_eq!(lasts, [0.0; 3], "{rate_hz} Hz, {} rad/s", drive.turn_radps);
    }
}

#[test]
fn headings_that_err_for_long_are_learnt_and_count_for_less() {
    let of_each = |_: i64, one: usize| if one % 4 < 2 { 0.1 } else { -0.1 };
    let learnt = driving(10, &WIDE, of_each);
    assert!((4.0..7.0).contains(&learnt.lasting_heading_sigma_deg), "{learnt:?}");
    assert_eq!(learnt.heading_offset_deg, 0.0, "they have no error in common");
}
