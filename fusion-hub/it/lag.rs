//! Smoothed objects at a lag behind the newest time.

use crate::world::{agent, at, config, description, detection, frame};
use proptest::prelude::*;
use v2x_common::detection::DetectionFrame;
use v2x_common::fused::FusedObject;
use v2x_common::id::TrackId;
use v2x_common::time::Span;
use v2x_fusion_hub::engine::Disposition;
use v2x_fusion_hub::engine::Engine;
use v2x_fusion_hub::engine::HistoryError;
use v2x_fusion_hub::fusion::{Hypotheses, MotionModel};

const AGENTS: [&str; 2] = ["ego", "rsu"];
const MOTIONS: [MotionModel; 2] = [MotionModel::Cv, MotionModel::Imm];

/// With this lag and two agents that have described themselves.
fn engine(lag_ms: i64, motion: MotionModel) -> Engine {
    let mut engine = Engine::new(config().with_tracking(|tracking| {
        tracking.motion = motion;
        tracking.tracker.hypotheses = Hypotheses::with_lag(Span::from_millis(lag_ms));
    }));
    AGENTS.iter().for_each(|name| {
        engine.handle_description(agent(name), description(1e-5)).expect("a valid description");
    });
    engine
}

/// A frame of an agent (by its place) that detects these objects with these errors.
fn frame_of(agent_place: usize, captured_ms: i64, objects: &[(u32, (f64, f64))]) -> DetectionFrame {
    let detections = objects.iter().map(|(object, error)| detection(*object, at(captured_ms), *error));
    let sequence = u64::try_from(captured_ms).expect("after the start");
    frame(agent(AGENTS[agent_place]), sequence, captured_ms, detections.collect())
}

fn take(engine: &mut Engine, frame: &DetectionFrame, now_ms: i64) {
    let disposition = engine.handle_frame(frame, at(now_ms));
    assert!(matches!(disposition, Disposition::Accepted { .. }), "{disposition:?}");
}

/// One object, measured by agent 0 every 100 ms from 0 to `until_ms`.
fn drive(engine: &mut Engine, until_ms: i64) {
    for ms in (0..=until_ms).step_by(100) {
        let error = if ms % 200 == 0 { 0.2 } else { -0.2 };
        take(engine, &frame_of(0, ms, &[(0, (error, 0.0))]), ms);
    }
}

fn only(objects: &[FusedObject]) -> FusedObject {
    assert_eq!(objects.len(), 1, "{objects:?}");
    objects[0].clone()
}

fn by_place(objects: &[FusedObject]) -> Vec<FusedObject> {
    // The track's number depends on the order of arrival.
    let unnumbered = |object: &FusedObject| FusedObject { track: TrackId::default(), ..object.clone() };
    let mut objects: Vec<_> = objects.iter().map(unnumbered).collect();
    objects.sort_by(|a, b| a.bev.y.total_cmp(&b.bev.y));
    objects
}

/// Frames of both agents that detect some of three objects, each at its own time within Δmax.
fn frames() -> impl Strategy<Value = Vec<DetectionFrame>> {
    let errors = prop::collection::vec(prop::option::weighted(0.8, (-0.3..0.3f64, -0.3..0.3f64)), 3);
    let frame = (0..AGENTS.len(), 0..490i64, errors).prop_map(|(agent, captured_ms, errors)| {
        let objects = (0..).zip(errors).filter_map(|(object, error)| Some((object, error?)));
        frame_of(agent, captured_ms, &objects.collect::<Vec<_>>())
    });
    prop::collection::vec(frame, 1..16).prop_map(|mut frames| {
        frames.sort_by_key(|frame| (frame.id.agent, frame.captured_at));
        frames.dedup_by_key(|frame| frame.id);
        frames
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn smoothed_objects_do_not_depend_on_the_order_of_arrival(
        (frames, order) in frames().prop_flat_map(|frames| {
            let order = Just((0..frames.len()).collect::<Vec<_>>()).prop_shuffle();
            (Just(frames), order)
        }),
        back_ms in 0..490i64,
    ) {
        for motion in MOTIONS {
            let published = |order: &mut dyn Iterator<Item = usize>| {
                let mut engine = engine(back_ms, motion);
                order.for_each(|place| take(&mut engine, &frames[place], 490));
                by_place(&engine.fused(at(490)).objects)
            };
            let mut sorted: Vec<usize> = (0..frames.len()).collect();
            sorted.sort_by_key(|place| (frames[*place].captured_at, frames[*place].id));
            prop_assert_eq!(published(&mut sorted.into_iter()), published(&mut order.iter().copied()));
        }
    }

    #[test]
    fn fused_as_of_the_newest_time_equals_the_current_list_bit_by_bit(frames in frames()) {
        for motion in MOTIONS {
            let run = || {
                let mut engine = engine(0, motion);
                frames.iter().for_each(|frame| take(&mut engine, frame, 490));
                engine
            };
            let (mut with_time, mut plain) = (run(), run());
            let past = with_time.fused_as_of(at(490), at(490)).expect("just now");
            prop_assert_eq!(past, plain.fused(at(490)));
        }
    }
}

#[test]
fn a_lag_changes_no_association_and_no_filtered_state() {
    for motion in MOTIONS {
        let [mut plain, mut lagged] = [0, 2000].map(|lag_ms| engine(lag_ms, motion));
        for step in 0..120_i64 {
            // The third object is missing for the coasting time without a lag, and then reported late.
            let is_there = |object: &u32| *object < 2 || !(40..58).contains(&step);
            let place = usize::from(step % 3 == 0);
            let error = 0.1 * f64::from(i32::try_from(step % 7).expect("small")) - 0.3;
            let objects: Vec<_> = (0..3).filter(is_there).map(|object| (object, (error, -error))).collect();
            let frame = frame_of(place, 100 * step, &objects);
            // A third of them late.
            let now_ms = 100 * step + if place == 1 { 300 } else { 0 };
            for engine in [&mut plain, &mut lagged] {
                take(engine, &frame, now_ms);
                engine.fused(at(now_ms));
            }
        }
        let now = at(12_200);
        let past = lagged.fused_as_of(now, now).expect("just now").objects.clone();
        assert_eq!(past.len(), 3);
        assert_eq!(past, plain.fused(now).objects);
    }
}

#[test]
fn a_lagged_frame_has_its_own_time_and_the_positions_of_that_time() {
    for motion in MOTIONS {
        let mut engine = engine(500, motion);
        drive(&mut engine, 2000);
        let fused = engine.fused(at(2000));
        assert_eq!(fused.fused_at, at(1500));
        let object = only(&fused.objects);
        assert!((object.bev.x - 15.0).abs() < 0.2, "{object:?}");
        assert_eq!((object.last_measured_at, object.age), (at(1500), Span::from_millis(1500)));
        assert_eq!(object.contributors[0].frame.sequence, 1500);
        // Between two reports, too.
        let object = only(&engine.fused(at(2040)).objects);
        assert!((object.bev.x - 15.4).abs() < 0.2, "{object:?}");
        assert_eq!((object.last_measured_at, object.age), (at(1500), Span::from_millis(1540)));
    }
}

#[test]
fn later_measurements_reduce_the_covariance_of_a_past_state() {
    for motion in MOTIONS {
        let variance = |object: &FusedObject| object.kinematic_covariance[0] + object.kinematic_covariance[4];
        let mut engine = engine(400, motion);
        drive(&mut engine, 1500);
        let then = only(&engine.fused_as_of(at(1500), at(1500)).expect("now").objects);
        take(&mut engine, &frame_of(0, 1600, &[(0, (0.2, 0.0))]), 1600);
        take(&mut engine, &frame_of(0, 1700, &[(0, (-0.2, 0.0))]), 1700);
        let later = only(&engine.fused_as_of(at(1500), at(1700)).expect("in history").objects);
        assert!(variance(&later) < 0.9 * variance(&then), "{then:?} {later:?}");
        assert!(later.yaw_variance < then.yaw_variance);
        // Late, but before that time is published.
        take(&mut engine, &frame_of(1, 1450, &[(0, (0.0, 0.1))]), 1800);
        let with_late = only(&engine.fused_as_of(at(1500), at(1800)).expect("in history").objects);
        assert!(variance(&with_late) < variance(&later), "{later:?} {with_late:?}");
        assert!(with_late.bev.y > later.bev.y);
        assert_eq!(with_late.contributors.len(), 2);
    }
}

#[test]
fn an_object_is_published_from_its_first_report_to_its_end() {
    for motion in MOTIONS {
        let mut engine = engine(1000, motion);
        for ms in (0..=2600).step_by(100) {
            let there: &[(u32, (f64, f64))] = match ms {
                0..1000 => &[(0, (0.0, 0.0))],
                1000..=1500 => &[(0, (0.0, 0.0)), (1, (0.0, 0.0))],
                _ => &[(0, (0.0, 0.0))],
            };
            take(&mut engine, &frame_of(0, ms, there), ms);
            let n_published = engine.fused(at(ms)).objects.len();
            let expected = match ms - 1000 {
                ..0 => 0,
                0..1000 => 1,
                1000..=1500 => 2,
                _ => 1,
            };
            assert_eq!(n_published, expected, "published at {ms} ms");
        }
        // Missed since then: it existed at its last detection.
        let published =
            |engine: &mut Engine, ms| engine.fused_as_of(at(ms), at(2600)).map(|fused| fused.objects.len());
        assert_eq!((published(&mut engine, 1600), published(&mut engine, 2600)), (Ok(1), Ok(1)));
    }
}

#[test]
fn folded_reports_keep_their_agent_among_the_contributors_as_without_a_lag() {
    let mut engine = engine(600, MotionModel::Imm);
    take(&mut engine, &frame_of(1, 0, &[(0, (0.0, 0.0))]), 0);
    for ms in (100..=1600).step_by(100) {
        take(&mut engine, &frame_of(0, ms, &[(0, (0.0, 0.0))]), ms);
        engine.fused(at(ms));
    }
    take(&mut engine, &frame_of(1, 1650, &[(0, (0.0, 0.0))]), 1650);
    let object = only(&engine.fused(at(1660)).objects);
    let sequences: Vec<u64> = object.contributors.iter().map(|one| one.frame.sequence).collect();
    assert_eq!(sequences, [1000, 0]);
}

#[test]
fn tracks_that_a_sensor_separated_stay_two_in_the_past_after_a_merge() {
    let mut engine = engine(1000, MotionModel::Imm);
    let beside = (0.0, 1.5);
    for ms in (0..=1000).step_by(50) {
        // From 200 ms on only one is reported, now here, now there: neither is deleted.
        let there: &[(u32, (f64, f64))] = match ms {
            0..200 => &[(0, (0.0, 0.0)), (0, beside)],
            _ if ms % 100 == 0 => &[(0, (0.0, 0.0))],
            _ => &[(0, beside)],
        };
        take(&mut engine, &frame_of(0, ms, there), ms);
    }
    assert_eq!(engine.counts().merges, 1);
    let published = |ms| engine.fused_as_of(at(ms), at(1000)).expect("in history").objects.clone();
    let [both, one] = [150, 1000].map(published);
    assert_eq!((both.len(), one.len()), (2, 1));
    assert!((both[1].bev.y - both[0].bev.y - 1.5).abs() < 0.3, "{both:?}");
    assert!(both[0].track < both[1].track && one[0].track == both[0].track);
}

#[test]
fn times_outside_the_history_are_an_error() {
    let mut engine = engine(1000, MotionModel::Imm);
    drive(&mut engine, 3000);
    let now = at(3000);
    let forgotten = HistoryError::Forgotten { at: at(1999), begins: at(2000) };
    assert_eq!(engine.fused_as_of(at(1999), now).cloned(), Err(forgotten));
    let in_future = HistoryError::InFuture { at: at(3001), now };
    assert_eq!(engine.fused_as_of(at(3001), now).cloned(), Err(in_future));
    assert_eq!(engine.fused_as_of(at(2000), now).map(|fused| fused.fused_at), Ok(at(2000)));
}

/// With a second list that is this much behind the live one.
fn engine_with_second_list(lag_ms: i64, motion: MotionModel) -> Engine {
    let second_lag = Some(Span::from_millis(lag_ms));
    Engine::new(config().with_tracking(|tracking| {
        tracking.motion = motion;
        tracking.tracker.hypotheses = Hypotheses::Single { lag: Span::ZERO, second_lag };
    }))
}

#[test]
fn a_second_list_holds_the_same_tracks_as_they_were_and_changes_nothing_of_the_first() {
    for motion in MOTIONS {
        let mut both = engine_with_second_list(500, motion);
        let [mut live, mut behind] = [0, 500].map(|lag_ms| {
            Engine::new(config().with_tracking(|tracking| {
                tracking.motion = motion;
                tracking.tracker.hypotheses = Hypotheses::with_lag(Span::from_millis(lag_ms));
            }))
        });
        assert!(live.lagged(at(0)).is_none(), "only where it is asked for");
        for ms in (0..=2000).step_by(100) {
            let frame = frame_of(0, ms, &[(0, (0.01, 0.0)), (1, (0.0, 0.02))]);
            [&mut both, &mut live, &mut behind].into_iter().for_each(|engine| take(engine, &frame, ms));
            let first = both.fused(at(ms)).clone();
            assert_eq!(&first, live.fused(at(ms)), "the first list is as without a second one");
            let second = both.lagged(at(ms)).expect("a second list");
            assert!(second.includes.is_empty());
            let expected = behind.fused(at(ms));
            assert_eq!((second.sequence, second.fused_at), (expected.sequence, expected.fused_at));
            assert_eq!(second.objects, expected.objects, "and the second as the list of a hub with that lag");
        }
        let second = both.lagged(at(2000)).expect("a second list");
        assert_eq!((second.fused_at, second.objects.len()), (at(1500), 2));
    }
}
