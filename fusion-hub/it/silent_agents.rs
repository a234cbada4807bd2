//! Agents that detect nothing, or something else: what one does not see is not taken from the others.

use crate::world::{agent, at, description, frame};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::HubId;
use v2x_common::sensor::SensorDescription;
use v2x_fusion_hub::engine::{Engine, EngineConfig};

const HERE: Pose = Pose { x: 0.0, y: 0.0, yaw: 0.0 };
/// Parked cars about the origin, m.
const PLACES: [[f64; 2]; 8] = [
    [12.0, 0.0],
    [-14.0, 6.0],
    [20.0, 15.0],
    [5.0, -22.0],
    [-25.0, -10.0],
    [30.0, -4.0],
    [-8.0, 28.0],
    [15.0, -16.0],
];

fn engine() -> Engine {
    Engine::new(EngineConfig::new(HubId::new("hub").expect("test input"), 1))
}

fn error(k: i64, what: i64) -> f64 {
    let mixed = (k * 7919 + what * 104_729).wrapping_mul(2_654_435_761).rem_euclid(2001);
    f64::from(i32::try_from(mixed).expect("below 2001")) / 1000.0 - 1.0
}

fn car([x, y]: [f64; 2], k: i64, what: i64) -> Detection {
    Detection {
        class: Class::Car,
        score: 1.0,
        bev: BevBox {
            x: x + 0.3 * error(k, what),
            y: y + 0.3 * error(k, what + 1),
            w: 1.8,
            d: 4.5,
            yaw: 0.02 * error(k, what + 2),
        },
        covariance: BoxCovariance { position: Covariance2::isotropic(0.25), ww: 0.01, dd: 0.04, yaw: 0.01 },
        velocity: None,
        heading: HeadingKind::Known,
        source_track: None,
    }
}

/// A frame at a time from the origin with these objects.
fn seen(name: &str, (k, ms): (i64, i64), places: &[[f64; 2]]) -> DetectionFrame {
    let salt = name.bytes().map(i64::from).sum::<i64>();
    let detections = (0..).zip(places).map(|(n, place)| car(*place, k, salt + 10 * n)).collect();
    let sent = frame(agent(name), u64::try_from(k).expect("a number"), ms, detections);
    DetectionFrame { sensor_pose: Some(HERE), sensor_revision: 1, ..sent }
}

fn declared(probability: f64, rate_hz: f64) -> SensorDescription {
    SensorDescription { detection_probability: probability, rate_hz, ..description(1e-4) }
}

fn describe(engine: &mut Engine, name: &str, description: &SensorDescription) {
    engine.handle_description(agent(name), *description).expect("a valid description");
}

/// Mean share of the parked cars that are published after the first ten seconds.
fn share_published(engine: &mut Engine, seconds: i64, frames: impl Fn(i64) -> Vec<DetectionFrame>) -> f64 {
    share_of(&PLACES, engine, seconds, frames)
}

/// The same of cars at these places.
fn share_of(
    places: &[[f64; 2]],
    engine: &mut Engine,
    seconds: i64,
    frames: impl Fn(i64) -> Vec<DetectionFrame>,
) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for ms in (0..1000 * seconds).step_by(50) {
        for sent in frames(ms) {
            engine.handle_frame(&sent, at(ms + 5));
        }
        if ms >= 10_000 && ms % 100 == 0 {
            let objects = &engine.fused(at(ms + 20)).objects;
            let is_there = |[x, y]: &&[f64; 2]| {
                objects.iter().any(|object| libm::hypot(object.bev.x - x, object.bev.y - y) < 1.5)
            };
            sum += places.iter().filter(is_there).count() as f64 / places.len() as f64;
            n += 1.0;
        }
    }
    sum / n
}

#[test]
fn a_dead_agent_that_declares_to_detect_everything_takes_nothing_from_slow_ones() {
    for dead_ms in [50, 100, 500] {
        let mut engine = engine();
        describe(&mut engine, "slow", &declared(0.9, 0.5));
        describe(&mut engine, "dead", &declared(0.999, 1000.0 / dead_ms as f64));
        let share = share_published(&mut engine, 30, |ms| {
            let mut frames = Vec::new();
            if ms % 2000 == 0 {
                frames.push(seen("slow", (ms / 2000, ms), &PLACES));
            }
            if ms % dead_ms == 0 {
                frames.push(seen("dead", (ms / dead_ms, ms), &[]));
            }
            frames
        });
        assert!(share > 0.9, "dead at {dead_ms} ms: {share}");
    }
}

#[test]
fn an_agent_that_describes_nothing_and_sees_only_some_objects_takes_none_from_those_that_describe_themselves()
{
    for n_seen in [0, 2, 4] {
        let mut engine = engine();
        for name in ["ego", "rsu"] {
            describe(&mut engine, name, &declared(0.95, 10.0));
        }
        let share = share_published(&mut engine, 20, |ms| {
            if ms % 100 != 0 {
                return Vec::new();
            }
            let k = ms / 100;
            // What it sees is elsewhere in part: its view reaches as far as the others'.
            let mut own: Vec<[f64; 2]> = PLACES[..n_seen].to_vec();
            own.extend([[40.0, 3.0], [-38.0, -20.0], [2.0, 35.0]]);
            vec![
                seen("ego", (k, ms), &PLACES[..5]),
                seen("rsu", (k, ms), &PLACES[3..]),
                DetectionFrame { sensor_revision: 0, ..seen("camera", (k, ms), &own) },
            ]
        });
        assert!(share > 0.98, "it sees {n_seen} of them: {share}");
    }
}

#[test]
fn what_one_agent_alone_sees_says_nothing_of_two_that_do_not() {
    let mut engine = engine();
    for name in ["ego", "rsu"] {
        describe(&mut engine, name, &declared(0.95, 10.0));
    }
    let made_up: Vec<[f64; 2]> = (0..6).map(|n| [-30.0 + 11.0 * f64::from(n), 33.0]).collect();
    share_published(&mut engine, 20, |ms| {
        if ms % 100 != 0 {
            return Vec::new();
        }
        let k = ms / 100;
        let camera = DetectionFrame { sensor_revision: 0, ..seen("camera", (k, ms), &made_up) };
        vec![seen("ego", (k, ms), &PLACES), seen("rsu", (k, ms), &PLACES), camera]
    });
    for name in ["ego", "rsu"] {
        let learnt = engine.learnt(&agent(name)).expect("an agent of whom something is learnt");
        assert!(!learnt.overrules_declared, "{name}: {learnt:?}");
    }
}

/// Parked cars of three streets, m.
fn streets() -> [Vec<[f64; 2]>; 3] {
    [0.0, 40.0, 80.0]
        .map(|y| (0..5).map(|n| [-30.0 + 14.0 * f64::from(n), y + 3.0 * f64::from(n % 2)]).collect())
}

#[test]
fn agents_that_describe_nothing_and_see_a_street_each_take_nothing_from_each_other() {
    let streets = streets();
    // One agent a street, and two in one of them, which outnumber the others.
    for agents in [&[("a", 0), ("b", 1), ("c", 2)][..], &[("a", 0), ("b", 1), ("b2", 1), ("c", 2), ("c2", 2)]]
    {
        let mut engine = engine();
        let share = share_of(&streets.concat(), &mut engine, 40, |ms| {
            if ms % 100 != 0 {
                return Vec::new();
            }
            let sent = agents.iter().map(|(name, street)| {
                let sensor_pose = Some(Pose { y: 40.0 * *street as f64 - 5.0, ..HERE });
                let seen = seen(name, (ms / 100, ms), &streets[*street]);
                DetectionFrame { sensor_revision: 0, sensor_pose, ..seen }
            });
            sent.collect()
        });
        assert!(share > 0.98, "{} agents: {share}", agents.len());
        for (name, _) in agents {
            let learnt = engine.learnt(&agent(name)).expect("an agent of whom something is learnt");
            assert!(learnt.detection_probability > Some(0.9), "{name}: {learnt:?}");
        }
    }
}
