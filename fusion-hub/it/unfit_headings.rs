//! Headings that are wrong for good, or missing, at the rates of slow sensors: positions count, whatever the class.

use crate::world::{agent, at, frame};
use std::f64::consts::PI;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, HeadingKind};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::{BevBox, wrap_angle};
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Engine, EngineConfig};

fn engine() -> Engine {
    Engine::new(EngineConfig::new(HubId::new("hub").expect("test input"), 1))
}

/// Errors that repeat in no short period: in [-1, 1].
fn error(k: i64, what: i64) -> f64 {
    let mixed = (k * 7919 + what * 104_729).wrapping_mul(2_654_435_761).rem_euclid(2001);
    f64::from(i32::try_from(mixed).expect("below 2001")) / 1000.0 - 1.0
}

/// What moves along a direction through the world.
#[derive(Clone, Copy, Debug)]
struct Mover {
    class: Class,
    size: [f64; 2],
    speed_mps: f64,
    course: f64,
}

const CAR: Mover = Mover { class: Class::Car, size: [1.8, 4.5], speed_mps: 10.0, course: 0.4 };
const BICYCLE: Mover = Mover { class: Class::Bicycle, size: [0.6, 1.8], speed_mps: 5.0, course: -2.0 };
const ADULT: Mover = Mover { class: Class::Adult, size: [0.6, 0.6], speed_mps: 1.4, course: 2.5 };

impl Mover {
    fn place(&self, ms: i64) -> [f64; 2] {
        let way_m = self.speed_mps * ms as f64 / 1000.0;
        [way_m * libm::cos(self.course), way_m * libm::sin(self.course)]
    }

    /// A report, σ .2 m, with this heading off its course, or without one.
    fn report(&self, (k, ms): (i64, i64), what: i64, off: Option<f64>) -> Detection {
        let [x, y] = self.place(ms);
        let yaw = off.map_or(0.0, |off| self.course + off + 0.05 * error(k, what + 2));
        Detection {
            class: self.class,
            score: 1.0,
            bev: BevBox {
                x: x + 0.3 * error(k, what),
                y: y + 0.3 * error(k, what + 1),
                w: self.size[0],
                d: self.size[1],
                yaw: wrap_angle(yaw),
            },
            covariance: BoxCovariance {
                position: Covariance2::isotropic(0.2),
                ww: 0.01,
                dd: 0.04,
                yaw: 0.01,
            },
            velocity: None,
            heading: if off.is_some() { HeadingKind::Known } else { HeadingKind::Unknown },
            source_track: None,
        }
    }

    fn velocity_error(&self, object: &FusedObject) -> f64 {
        let (vx, vy) = object.velocity;
        libm::hypot(
            vx - self.speed_mps * libm::cos(self.course),
            vy - self.speed_mps * libm::sin(self.course),
        )
    }
}

/// Of lists at 10 Hz from the sixth frame on: the share with one object near the true place, and the mean error of the velocity
/// there, m/s.
fn followed(
    mover: &Mover,
    (period_ms, n): (i64, i64),
    agents: &[&str],
    report: impl Fn(usize, (i64, i64)) -> Detection,
) -> (f64, f64) {
    let mut engine = engine();
    let (mut found, mut ticks, mut errors) = (0.0, 0.0, 0.0);
    for k in 0..n {
        for (number, name) in agents.iter().enumerate() {
            let ms = period_ms * k + 7 * number as i64;
            let sent =
                frame(agent(name), u64::try_from(k).expect("a number"), ms, vec![report(number, (k, ms))]);
            engine.handle_frame(&sent, at(ms + 20));
        }
        for ms in (period_ms * k + 40..period_ms * (k + 1)).step_by(100).filter(|_| k >= 5) {
            let [x, y] = mover.place(ms);
            ticks += 1.0;
            if let [object] = engine.fused(at(ms)).objects.as_slice()
                && libm::hypot(object.bev.x - x, object.bev.y - y) < 2.5
            {
                found += 1.0;
                errors += mover.velocity_error(object);
            }
        }
    }
    (found / ticks, errors / f64::max(found, 1.0))
}

#[test]
fn an_object_whose_headings_are_wrong_for_good_is_followed_by_its_positions_at_any_rate_and_of_any_class() {
    for mover in [CAR, BICYCLE, ADULT] {
        for period_ms in [100, 500, 1000, 2000] {
            for off_deg in [0.0_f64, 30.0, 90.0, -135.0, 180.0] {
                // A person who is seen every two seconds, and sideways, is taken for standing at times.
                if mover.class == Class::Adult && period_ms == 2000 {
                    continue;
                }
                let rate = (period_ms, 12 + 3000 / period_ms);
                let report = |_, at| mover.report(at, 0, Some(off_deg.to_radians()));
                let (share, velocity) = followed(&mover, rate, &["lidar"], report);
                let context = format!("{:?} every {period_ms} ms, {off_deg} degrees off", mover.class);
                assert!(share > 0.65, "{context}: {share} followed");
                assert!(velocity < 0.12 * mover.speed_mps + 0.6, "{context}: {velocity} m/s");
            }
        }
    }
}

#[test]
fn an_object_without_headings_is_followed_by_its_positions_at_any_rate_and_of_any_class() {
    for mover in [CAR, BICYCLE, ADULT] {
        for period_ms in [100, 500, 1000, 2000] {
            let report = |_, at| mover.report(at, 0, None);
            let (share, velocity) = followed(&mover, (period_ms, 12 + 3000 / period_ms), &["lidar"], report);
            assert!(share > 0.8, "{:?} every {period_ms} ms: {share} followed", mover.class);
            assert!(
                velocity < 0.12 * mover.speed_mps + 0.5,
                "{:?}, {period_ms} ms: {velocity} m/s",
                mover.class
            );
        }
    }
}

#[test]
fn of_several_agents_one_whose_headings_are_off_for_good_costs_no_velocity() {
    for mover in [CAR, BICYCLE] {
        for off_deg in [30.0_f64, 45.0, 90.0, 180.0] {
            let report = |number: usize, at| {
                let off = if number == 1 { off_deg.to_radians() } else { 0.0 };
                mover.report(at, 10 * number as i64, Some(off))
            };
            let (share, velocity) = followed(&mover, (100, 100), &["a", "b"], report);
            assert!(share > 0.99 && velocity < 0.8, "{:?}, {off_deg}: {share}, {velocity} m/s", mover.class);
        }
    }
}

#[test]
fn people_who_turn_and_whose_headings_are_turned_keep_their_velocity() {
    let report = |_, (k, ms): (i64, i64)| {
        let off = if k % 3 == 0 { PI } else { 0.0 };
        ADULT.report((k, ms), 0, Some(off))
    };
    let (share, velocity) = followed(&ADULT, (100, 80), &["camera"], report);
    assert!(share > 0.95 && velocity < 0.5, "{share}, {velocity} m/s");
}

#[test]
fn tracks_of_an_agent_that_have_no_velocity_get_one_whatever_their_class_and_rate() {
    for mover in [CAR, BICYCLE, ADULT] {
        for period_ms in [50, 100, 500] {
            for off in [Some(0.0), None] {
                let report = |_, at| Detection { source_track: Some(7), ..mover.report(at, 0, off) };
                let (share, velocity) =
                    followed(&mover, (period_ms, 15_000 / period_ms), &["tracker"], report);
                let context = format!("{:?} every {period_ms} ms, heading {off:?}", mover.class);
                assert!(share > 0.9, "{context}: {share} followed");
                assert!(velocity < 0.08 * mover.speed_mps + 0.5, "{context}: {velocity} m/s");
            }
        }
    }
}
