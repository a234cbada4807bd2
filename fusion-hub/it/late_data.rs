//! Policies for late data other than replay: baselines of experiments.

use crate::world::{agent, at, config, detection, frame};
use v2x_common::detection::Detection;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::EngineConfig;
use v2x_fusion_hub::engine::{Disposition, Refusal};
use v2x_fusion_hub::fusion::LateFrames;

fn engine(late_frames: LateFrames) -> Engine {
    Engine::new(EngineConfig { late_frames, ..config() })
}

fn detections(ms: i64) -> Vec<Detection> {
    vec![detection(0, at(ms), (0.0, 0.0))]
}

/// One agent in time every 100 ms, and one that captures 50 ms after it and arrives 200 ms late.
fn run(late_frames: LateFrames, late_agent_reports: bool) -> Engine {
    let (mut engine, ego, rsu) = (engine(late_frames), agent("ego"), agent("rsu"));
    for sequence in 0..20u8 {
        let ms = i64::from(sequence) * 100;
        let _ = engine.handle_frame(&frame(ego, u64::from(sequence), ms, detections(ms)), at(ms));
        if late_agent_reports && ms >= 200 {
            let captured_ms = ms - 150;
            let late = frame(rsu, u64::from(sequence), captured_ms, detections(captured_ms));
            let _ = engine.handle_frame(&late, at(ms + 50));
        }
    }
    engine
}

#[test]
fn dropped_late_frames_change_no_published_object() {
    let (mut dropped, mut alone) = (run(LateFrames::Drop, true), run(LateFrames::Fuse, false));
    assert_eq!(dropped.agents().record(&agent("rsu")).unwrap().statistics.refused["out_of_sequence"], 18);
    assert_eq!(dropped.fused(at(2000)).objects, alone.fused(at(2000)).objects);
}

#[test]
fn a_frame_within_epsilon_of_the_newest_is_not_late() {
    let mut engine = engine(LateFrames::Drop);
    let take = |engine: &mut Engine, name: &str, ms: i64| {
        engine.handle_frame(&frame(agent(name), 0, ms, detections(ms)), at(100))
    };
    assert!(matches!(take(&mut engine, "a", 60), Disposition::Accepted { .. }));
    assert!(matches!(take(&mut engine, "b", 50), Disposition::Accepted { .. }));
    let refused = take(&mut engine, "c", 49);
    assert!(matches!(refused, Disposition::Refused(Refusal::OutOfSequence { .. })), "{refused:?}");
}

#[test]
fn ignoring_delays_biases_a_moving_object_backwards() {
    // At 10 m/s, half of the reports 200 ms old: they pull the object back by some of 2 m.
    let x = |mut engine: Engine| engine.fused(at(1950)).objects[0].bev.x;
    let (ignoring, replaying) = (x(run(LateFrames::IgnoreDelay, true)), x(run(LateFrames::Fuse, true)));
    assert!((replaying - 19.5).abs() < 0.05, "{replaying}");
    assert!(ignoring < 19.2, "{ignoring}");
}

#[test]
fn a_hub_that_ignores_delays_refuses_no_old_frame_and_keeps_the_agents_stamps() {
    let mut engine = engine(LateFrames::IgnoreDelay);
    let disposition = engine.handle_frame(&frame(agent("rsu"), 0, 0, detections(0)), at(30_000));
    assert!(matches!(disposition, Disposition::Accepted { .. }), "{disposition:?}");
    let fused = engine.fused(at(30_000));
    assert_eq!((fused.objects.len(), fused.includes[0].captured_at), (1, at(0)));
}

#[test]
fn an_agent_whose_clock_was_ahead_and_is_set_right_leaves_no_second_car_and_nothing_of_others_is_lost() {
    let mut engine = Engine::new(config());
    let mut n_objects = Vec::new();
    let mut kept = Vec::new();
    for k in 0..40_i64 {
        let (now_ms, ahead_ms) = (100 * k + 20, if k < 20 { 400 } else { 0 });
        let sequence = u64::try_from(k).expect("a number");
        let own = |object: u32| vec![detection(object, at(100 * k), (0.0, 0.0))];
        let ahead = frame(agent("ahead"), sequence, 100 * k + ahead_ms, own(0));
        let exact = frame(agent("exact"), sequence, 100 * k, own(1));
        for sent in [ahead, exact] {
            let disposition = engine.handle_frame(&sent, at(now_ms));
            assert!(matches!(disposition, Disposition::Accepted { .. }), "{disposition:?}");
        }
        let objects = &engine.fused(at(now_ms)).objects;
        n_objects.push(objects.len());
        kept.extend(objects.iter().filter(|object| object.bev.y > 25.0).map(|object| object.track));
    }
    assert_eq!(n_objects, [2; 40]);
    kept.dedup();
    assert_eq!(kept.len(), 1, "the other agent's car has one id");
    assert_eq!(engine.agents().record(&agent("ahead")).expect("it was heard").statistics.clock_set_back, 1);
}
