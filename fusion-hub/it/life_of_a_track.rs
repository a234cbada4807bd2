//! Tracks are confirmed and deleted by evidence in time, never by cycles of the hub.

use crate::world::{agent, at, description, detection, engine, frame};
use v2x_common::fused::FusedFrame;
use v2x_fusion_hub::engine::Engine;

/// One agent at 10 Hz which reports object 0 in the frames of `is_detected`, and a hub asked every `step_ms`.
fn published_at(is_detected: impl Fn(u64) -> bool, clutter_per_m2: f64, step_ms: i64) -> Vec<(i64, usize)> {
    let mut engine = engine();
    engine.handle_description(agent("ego"), description(clutter_per_m2)).expect("a valid description");
    let mut published = Vec::new();
    let mut next = 0;
    for ms in (0..4000).step_by(usize::try_from(step_ms).expect("test input")) {
        while i64::try_from(next).expect("test input") * 100 <= ms {
            let captured_ms = i64::try_from(next).expect("test input") * 100;
            let detections =
                if is_detected(next) { vec![detection(0, at(captured_ms), (0.0, 0.0))] } else { vec![] };
            engine.handle_frame(&frame(agent("ego"), next, captured_ms, detections), at(captured_ms));
            next += 1;
        }
        if ms % 200 == 0 {
            published.push((ms, engine.fused(at(ms)).objects.len()));
        } else {
            engine.fused(at(ms));
        }
    }
    published
}

#[test]
fn confirmation_and_deletion_do_not_depend_on_the_hubs_rate() {
    let is_detected = |k| (3..12).contains(&k) || k == 25;
    let at_50_hz = published_at(is_detected, 1e-4, 20);
    for step_ms in [50, 100, 200] {
        assert_eq!(published_at(is_detected, 1e-4, step_ms), at_50_hz, "hub at every {step_ms} ms");
    }
    assert!(at_50_hz.contains(&(1000, 1)) && at_50_hz.contains(&(2000, 0)), "{at_50_hz:?}");
}

#[test]
fn with_clutter_two_reports_confirm_and_one_does_not() {
    let published = published_at(|k| k == 5 || k == 15 || k == 16, 1e-4, 100);
    assert!(published.contains(&(600, 0)), "{published:?}");
    assert!(published.contains(&(1600, 1)), "{published:?}");
}

#[test]
fn without_clutter_the_first_report_confirms() {
    assert!(published_at(|k| k == 2, 0.0, 100).contains(&(200, 1)));
}

#[test]
fn an_agent_at_1_hz_keeps_its_tracks() {
    let mut engine = engine();
    let mut objects = Vec::new();
    for second in 0..6 {
        let ms = 1000 * second;
        let sequence = u64::try_from(second).expect("test input");
        engine
            .handle_frame(&frame(agent("rsu"), sequence, ms, vec![detection(0, at(ms), (0.0, 0.0))]), at(ms));
        objects.push(engine.fused(at(ms + 900)).objects.clone());
    }
    let ids: Vec<_> = objects.iter().flatten().map(|object| object.track).collect();
    assert_eq!(ids.len(), 6, "an object in every second");
    assert!(ids.windows(2).all(|pair| pair[0] == pair[1]), "and always the same: {ids:?}");
}

#[test]
fn an_object_without_coverage_is_published_for_the_coasting_time_only() {
    let mut engine = engine();
    engine.handle_frame(&frame(agent("rsu"), 0, 0, vec![detection(0, at(0), (0.0, 0.0))]), at(0));
    let count = |engine: &mut Engine, ms| engine.fused(at(ms)).objects.len();
    assert_eq!((count(&mut engine, 1900), count(&mut engine, 2100)), (1, 0));
    engine.fused(at(3100));
    assert_eq!(engine.counts().tracks, 0, "and is forgotten");
}

#[test]
fn a_fused_frame_names_each_frame_that_it_is_the_first_to_contain() {
    let mut engine = engine();
    let sent = frame(agent("ego"), 4, 0, vec![]);
    engine.handle_frame(&sent, at(30));
    engine.handle_frame(&sent, at(31));
    let FusedFrame { includes, agents, .. } = engine.fused(at(40)).clone();
    assert_eq!(includes.len(), 1, "the duplicate is not in it");
    assert_eq!((includes[0].frame, includes[0].received_at), (sent.id, at(30)));
    assert_eq!((agents[0].accepted, agents[0].refused), (1, 1));
    assert!(engine.fused(at(50)).includes.is_empty());
}

#[test]
fn a_position_that_is_hardly_known_is_not_published_and_does_not_affect_others() {
    use v2x_common::covariance::Covariance2;
    let mut engine = engine();
    let mut vague = detection(0, at(0), (0.0, 0.0));
    vague.covariance.position = Covariance2::isotropic(69.9);
    engine.handle_frame(&frame(agent("rsu"), 0, 0, vec![vague, detection(1, at(0), (0.0, 0.0))]), at(0));
    assert_eq!(engine.fused(at(0)).objects.len(), 1);
    let later = engine.fused(at(1000)).clone();
    assert_eq!(later.objects.len(), 1);
    let mut bytes = Vec::new();
    assert_eq!(v2x_common::wire::fused::encode(&later, &mut bytes), Ok(()));
}

#[test]
fn an_agent_with_the_fault_of_being_at_the_other_end_of_the_world_does_not_silence_others() {
    let mut engine = engine();
    let mut lost = frame(agent("lost"), 0, 0, vec![detection(0, at(0), (500_000.0, 5_400_000.0))]);
    lost.sensor_pose = None;
    engine.handle_frame(&lost, at(0));
    engine.handle_frame(&frame(agent("rsu"), 0, 0, vec![detection(1, at(0), (0.0, 0.0))]), at(0));
    let fused = engine.fused(at(0)).clone();
    assert_eq!(fused.objects.len(), 2);
    let mut bytes = Vec::new();
    assert_eq!(v2x_common::wire::fused::encode(&fused, &mut bytes), Ok(()));
}

/// The ids of three cars at 8 m/s before and after a while in which the hub did not run.
fn ids_around_a_gap(is_noted: bool) -> [Vec<v2x_common::id::TrackId>; 2] {
    let mut engine = engine();
    let mut ids: Vec<Vec<_>> = Vec::new();
    let mut second_of = |engine: &mut Engine, from_ms: i64| {
        for ms in (from_ms..from_ms + 1000).step_by(100) {
            let detections = (0..3).map(|object| {
                let mut detection = detection(object, at(0), (0.0, 0.0));
                detection.bev.x += 0.008 * ms as f64;
                detection
            });
            let sequence = u64::try_from(ms).expect("test input");
            engine.handle_frame(&frame(agent("rsu"), sequence, ms, detections.collect()), at(ms));
            let list = engine.fused(at(ms));
            ids.push(list.objects.iter().map(|object| object.track).collect());
        }
    };
    second_of(&mut engine, 0);
    second_of(&mut engine, 1000);
    if is_noted {
        engine.note_held_up(at(6_900), v2x_common::time::Span::from_millis(5_000));
    }
    // As a hub does that goes on: its list is due first.
    engine.fused(at(6_900));
    second_of(&mut engine, 7_000);
    let (last, before) = (ids.pop().expect("lists"), ids[19].clone());
    [before, last]
}

#[test]
fn objects_keep_their_ids_over_five_seconds_in_which_the_hub_was_stopped() {
    let [mut before, mut after] = ids_around_a_gap(true);
    before.sort_unstable();
    after.sort_unstable();
    assert_eq!((before.len(), &before), (3, &after));
    let [before, after] = ids_around_a_gap(false);
    assert!(before.iter().all(|id| !after.contains(id)), "a while without detections is another thing");
}
