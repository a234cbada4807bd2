//! Of many agents at one crossing, the one that is wrong is found, by whichever name, and is found as long as it is wrong.

use crate::diagnosis::crossing::noise;
use std::f64::consts::{PI, TAU};
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{Detection, DetectionFrame, HeadingKind};
use v2x_common::fused::{FusedFrame, FusedObject};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::id::{AgentId, FrameId, HubId, TrackId};
use v2x_common::reported::Reported;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::diagnosis::{Code, Finding, Observation, Source, Surroundings, Survey, Tokens};
use v2x_fusion_hub::{Engine, EngineConfig};

/// Long enough for two windows and the comparison of twenty pairs after each, s.
const DURATION_S: i64 = 76;

fn at(ms: i64) -> Timestamp {
    Timestamp::EPOCH + Span::from_millis(1_790_000_000_000 + ms)
}

fn name(n: usize) -> AgentId {
    AgentId::new(&format!("a{n:02}")).expect("a name")
}

/// Place and velocity of the cars at a time, s.
fn cars(t: f64) -> Vec<([f64; 2], [f64; 2])> {
    let mut cars = Vec::new();
    for n in 0..2 {
        let along = |speed: f64| (39.0 * f64::from(n) + speed * t).rem_euclid(78.0) - 39.0;
        cars.push(([along(9.0), -2.0], [9.0, 0.0]));
        cars.push(([-along(8.0), 2.0], [-8.0, 0.0]));
        cars.push(([-2.0, -along(7.0)], [0.0, -7.0]));
        cars.push(([2.0, along(10.0)], [0.0, 10.0]));
    }
    cars
}

fn car(x: f64, y: f64, [vx, vy]: [f64; 2]) -> BevBox {
    BevBox { x, y, w: 1.8, d: 4.5, yaw: libm::atan2(vy, vx) }
}

/// What an agent sees: it stands somewhere around the crossing.
fn frame(n: usize, ms: i64) -> DetectionFrame {
    let angle = TAU * (n as f64 * 0.618).fract();
    let pose = Pose { x: 30.0 * libm::cos(angle), y: 30.0 * libm::sin(angle), yaw: angle + PI };
    let id = FrameId { agent: name(n), epoch: 1, sequence: ms.unsigned_abs() };
    let mut frame = DetectionFrame { sensor_pose: Some(pose), ..DetectionFrame::empty(id, at(ms)) };
    let seed = ms.unsigned_abs() * 101 + n as u64;
    for (k, ([x, y], velocity)) in cars(ms as f64 * 1e-3).into_iter().enumerate() {
        let error = |which: u64| 0.25 * noise(seed, k as u64, which);
        if noise(seed, k as u64, 9) < 1.2 {
            frame.detections.push(Detection {
                class: Class::Car,
                score: 1.0,
                bev: car(x + error(0), y + error(1), velocity),
                covariance: BoxCovariance {
                    position: Covariance2::isotropic(0.0625),
                    ww: 0.01,
                    dd: 0.04,
                    yaw: 0.01,
                },
                velocity: None,
                heading: HeadingKind::Known,
                source_track: None,
            });
        }
    }
    frame
}

fn list(ms: i64) -> FusedFrame {
    let objects = cars(ms as f64 * 1e-3).into_iter().enumerate().map(|(k, ([x, y], velocity))| {
        let mut object = FusedObject::from_box(TrackId(k as u64), Class::Car, car(x, y, velocity));
        object.velocity = velocity.into();
        object
    });
    FusedFrame {
        hub: HubId::new("hub").expect("a name"),
        lineage: 1,
        sequence: ms.unsigned_abs(),
        fused_at: at(ms),
        map_frame: None,
        objects: objects.collect(),
        agents: Vec::new(),
        includes: Vec::new(),
    }
}

/// The faults that are found each second, of so many agents of which one writes its frames wrongly.
fn faults(n: usize, wrong: usize, write: impl Fn(&mut DetectionFrame)) -> Vec<(i64, Vec<Finding>)> {
    let mut found = findings((n, wrong), write, list);
    found.iter_mut().for_each(|(_, findings)| findings.retain(Finding::is_fault));
    found
}

/// All that is found each second; `list` is what the hub publishes.
fn findings(
    (n, wrong): (usize, usize),
    write: impl Fn(&mut DetectionFrame),
    list: impl Fn(i64) -> FusedFrame,
) -> Vec<(i64, Vec<Finding>)> {
    let engine = Engine::new(EngineConfig::new(HubId::new("hub").expect("a name"), 1));
    let (tokens, mut survey, mut found) = (Tokens::default(), Survey::default(), Vec::new());
    let reported = Reported { has_sequence: false, ..Reported::default() };
    for k in 0..DURATION_S * 10 {
        survey.note_list(&list(100 * k));
        for agent in 0..n {
            // Each has a phase of its own, so that they arrive in one order always.
            let ms = 100 * k + (agent as i64 * 37) % 100;
            let mut frame = frame(agent, ms);
            if agent == wrong || wrong == usize::MAX {
                write(&mut frame);
            }
            let received_at = at(ms + 20);
            survey.note_frame(&Observation { frame: &frame, reported: &reported, received_at });
        }
        if k % 10 == 9 {
            survey.diagnose(
                &Surroundings { engine: &engine, tokens: &tokens, source: Source::Network },
                at(100 * k + 120),
            );
            if survey.judged_since().is_some() {
                found.push((k / 10, survey.findings().to_vec()));
            }
        }
    }
    found
}

fn shifted(frame: &mut DetectionFrame) {
    frame.detections.iter_mut().for_each(|one| (one.bev.x, one.bev.y) = (one.bev.x + 4.0, one.bev.y - 3.0));
}

#[test]
fn an_agent_that_is_off_is_found_among_ten_twenty_and_thirty_at_every_second() {
    for n in [10, 20, 30] {
        for wrong in [0, n / 2, n - 1] {
            let found = faults(n, wrong, shifted);
            assert!(found.len() > 30, "{n} agents: judged for {} s", found.len());
            for (second, faults) in found {
                let of_wrong = |one: &Finding| one.agent == Some(name(wrong));
                // Of thirty most are compared with one other, and then nobody knows which of both is wrong; shifted by a lane it
                // also seems to see what comes the other way.
                let is_offset = |one: &Finding| {
                    let is_named = n == 30 && one.agent.is_none() && one.says.contains(name(wrong).as_str());
                    one.code == Code::Offset && (of_wrong(one) || is_named)
                };
                let is_expected = |one: &Finding| is_offset(one) || (n == 30 && of_wrong(one));
                assert!(
                    faults.iter().any(is_offset) && faults.iter().all(is_expected),
                    "{n} agents, {} is wrong, at {second} s: {faults:#?}",
                    name(wrong)
                );
            }
        }
    }
}

#[test]
fn many_sound_agents_have_no_fault() {
    for (second, faults) in faults(25, usize::MAX, |_| {}) {
        assert_eq!(faults, [], "at {second} s");
    }
}

#[test]
fn an_agent_in_the_frame_of_its_sensor_is_found_among_twenty() {
    let relative = |frame: &mut DetectionFrame| {
        let Some(pose) = frame.sensor_pose else { return };
        let (sin, cos) = libm::sincos(pose.yaw);
        for one in &mut frame.detections {
            let (x, y) = (one.bev.x - pose.x, one.bev.y - pose.y);
            (one.bev.x, one.bev.y) = (x * cos + y * sin, y * cos - x * sin);
        }
    };
    for (second, faults) in faults(20, 7, relative) {
        let is_it = |one: &Finding| one.code == Code::SensorFrame && one.agent == Some(name(7));
        assert!(faults.iter().any(is_it), "at {second} s: {faults:#?}");
    }
}

#[test]
fn a_shift_is_a_note_as_long_as_nobody_knows_how_fast_the_objects_move() {
    // Objects without velocities, as of a hub that has just begun.
    let unknown = |ms: i64| FusedFrame { objects: Vec::new(), ..list(ms) };
    let only_one_road = |frame: &mut DetectionFrame| {
        frame.detections.retain(|one| one.bev.yaw.abs() < 0.1);
        let behind_s = if frame.id.agent == name(1) { 0.25 } else { 0.0 };
        frame.detections.iter_mut().for_each(|one| one.bev.x += 9.0 * behind_s);
    };
    // Both write so, by their names.
    let found = findings((2, usize::MAX), only_one_road, unknown);
    let offsets: Vec<_> =
        found.iter().flat_map(|(_, all)| all).filter(|one| one.code == Code::Offset).collect();
    assert!(!offsets.is_empty() && offsets.iter().all(|one| !one.is_fault()), "{offsets:#?}");
    assert!(offsets[0].says.contains("whether places differ, or clocks"), "{}", offsets[0]);
}
