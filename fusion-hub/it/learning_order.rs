//! How much of what is learnt depends on the order of arrival, where assignments do: in dense traffic.

use crate::world::{agent, at, box_of, draw, frame};
use v2x_common::class::Class;
use v2x_common::detection::{Detection, DetectionFrame};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::Pose;
use v2x_common::id::HubId;
use v2x_fusion_hub::engine::{Disposition, Engine, EngineConfig};
use v2x_fusion_hub::learning::LearntSensorReport;

const FRAMES: i64 = 300;
const AGENTS: [(&str, f64); 2] = [("first", -12.0), ("second", 14.0)];

/// A crowd that walks both ways, a metre and a half apart, beside a queue of cars: with errors of .7 m, one frame does not say
/// who is who.
fn detections(k: i64, sensor: i64) -> Vec<Detection> {
    let time_s = 0.1 * k as f64 + 0.03 * sensor as f64;
    let people = (0..24_i64).map(|who| {
        let (row, place) = (who % 4, who / 4);
        let speed = if row % 2 == 0 { 1.3 } else { -1.2 };
        let x = (1.5 * place as f64 + speed * time_s).rem_euclid(30.0) - 15.0;
        (Class::Adult, [x, 1.5 * row as f64 - 8.0])
    });
    let cars = (0..5_i64).map(|who| (Class::Car, [7.0 * who as f64 - 15.0, 6.0]));
    let seen = (0..).zip(people.chain(cars)).filter(|(what, _)| draw(k, sensor, *what) < 0.8);
    let mut reports: Vec<_> = seen
        .map(|(what, (class, [x, y]))| {
            let error = |axis: i64| 1.4 * (draw(k, sensor, 100 + 2 * what + axis) - 0.5);
            box_of(class, 0.16, [x + error(0), y + error(1)])
        })
        .collect();
    for what in 0..3 {
        let place = [40.0 * draw(k, sensor, 300 + what) - 20.0, 30.0 * draw(k, sensor, 310 + what) - 15.0];
        reports.push(box_of(Class::Adult, 0.16, place));
    }
    reports
}

/// What both agents are found to be, and the last list, where each frame arrives up to so much later, by draws of a seed.
fn run(later_ms: f64, seed: i64) -> ([LearntSensorReport; 2], Vec<FusedObject>) {
    let mut arrivals: Vec<_> = (0..FRAMES)
        .flat_map(|k| [(k, 0), (k, 1)])
        .map(|(k, sensor)| {
            let later = later_ms * draw(k, sensor, 1000 + seed);
            (100 * k + 30 * sensor + 10 + libm::round(later) as i64, k, sensor)
        })
        .collect();
    arrivals.sort_unstable();
    let mut engine = Engine::new(EngineConfig::new(HubId::new("hub").expect("test input"), 1));
    for (arrives_ms, k, sensor) in arrivals {
        let (name, x) = AGENTS[usize::try_from(sensor).expect("two")];
        let sequence = u64::try_from(k).expect("a number");
        let sent = frame(agent(name), sequence, 100 * k + 30 * sensor, detections(k, sensor));
        let sent = DetectionFrame { sensor_pose: Some(Pose { x, y: 0.0, yaw: 0.0 }), ..sent };
        let disposition = engine.handle_frame(&sent, at(arrives_ms));
        assert!(matches!(disposition, Disposition::Accepted { .. }), "{disposition:?}");
    }
    let objects = engine.fused(at(100 * FRAMES + 400)).objects.clone();
    (AGENTS.map(|(name, _)| engine.learnt(&agent(name)).expect("an agent with frames")), objects)
}

#[test]
fn what_is_learnt_in_a_crowd_hardly_depends_on_the_order_of_arrival() {
    let (in_time, _) = run(0.0, 0);
    for seed in 1..4 {
        let (mixed, objects) = run(450.0, seed);
        assert!(objects.len() > 20, "the crowd is there: {}", objects.len());
        for (one, other) in in_time.iter().zip(&mixed) {
            let apart = |of: fn(&LearntSensorReport) -> f64| (of(one) - of(other)).abs();
            let of_probability = apart(|known| known.detection_probability.unwrap_or(f64::NAN));
            let of_correlation = apart(|known| known.detection_correlation);
            let of_false = apart(|known| known.false_per_frame.unwrap_or(f64::NAN));
            assert!(of_probability < 0.04, "detection probability: {of_probability} apart");
            assert!(of_correlation < 0.06, "correlation: {of_correlation} apart");
            assert!(of_false < 0.2, "false detections of three a frame: {of_false} apart");
        }
    }
}
