//! Followed lists: whatever is lost on the way, they are within the tolerance of the whole list.

use crate::fixture;
use proptest::collection::vec;
use proptest::prelude::*;
use v2x_common::class::Class;
use v2x_common::detection::HeadingKind;
use v2x_common::fused::{FusedFrame, FusedObject, KINEMATIC_DIAGONAL};
use v2x_common::geometry::{BevBox, angle_difference};
use v2x_common::id::{HubId, TrackId};
use v2x_common::lists::{AreaFollower, DeltaFollower, DeltaFrame, FollowError, ListUpdate, Tolerance};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;

const TOLERANCE: Tolerance = Tolerance::HUB;
const INTERVAL: Span = Span::from_millis(100);
/// Half a step of the wire at the key frame and here, and velocities of half a step over a second.
const RESOLUTION_M: f64 = 2e-3;

/// By how much an object moves away from constant velocity in one step, and whether it is there.
#[derive(Clone, Copy, Debug)]
struct Step {
    shift: (f64, f64),
    speed_up: (f64, f64),
    turn: f64,
    growth: f64,
    existence: f64,
    variance_factor: f64,
    is_there: bool,
    is_truck: bool,
    axis: bool,
}

/// Mostly small, so that most objects stay as they are taken to be.
fn little(most: f64) -> impl Strategy<Value = f64> {
    prop_oneof![6 => Just(0.0), 3 => -0.3 * most..0.3 * most, 1 => -3.0 * most..3.0 * most]
}

fn step() -> impl Strategy<Value = Step> {
    let motion = (little(0.2), little(0.2), little(0.5), little(0.5), little(0.05));
    let rest =
        (little(0.1), little(0.1), little(0.7), prop::bool::weighted(0.95), prop::bool::weighted(0.05));
    (motion, rest, prop::bool::weighted(0.05)).prop_map(
        |((x, y, vx, vy, turn), (growth, existence, log, is_there, is_truck), axis)| Step {
            shift: (x, y),
            speed_up: (vx, vy),
            turn,
            growth,
            existence,
            variance_factor: libm::exp(log),
            is_there,
            is_truck,
            axis,
        },
    )
}

fn object(number: u32) -> FusedObject {
    let place = f64::from(number);
    let bev = BevBox { x: 10.0 * place, y: -5.0 * place, w: 1.8, d: 4.5, yaw: 0.3 * place };
    let mut object = FusedObject::from_box(TrackId::new(7, number), Class::Car, bev);
    object.velocity = (3.0 - place, place);
    object.existence = 0.9;
    object
}

fn advance(object: &mut FusedObject, step: &Step) {
    let seconds = INTERVAL.as_secs_f64();
    object.age = object.age + INTERVAL;
    object.bev.x += object.velocity.0 * seconds + step.shift.0;
    object.bev.y += object.velocity.1 * seconds + step.shift.1;
    object.velocity = (object.velocity.0 + step.speed_up.0, object.velocity.1 + step.speed_up.1);
    object.bev.yaw = v2x_common::geometry::wrap_angle(object.bev.yaw + step.turn);
    object.bev.w = (object.bev.w + step.growth).clamp(0.5, 3.0);
    object.existence = (object.existence + step.existence).clamp(0.5, 1.0);
    let variances = object.kinematic_covariance.iter_mut();
    variances.for_each(|value| *value = (*value * step.variance_factor).clamp(0.0, 1000.0));
    for place in KINEMATIC_DIAGONAL {
        object.kinematic_covariance[place] = object.kinematic_covariance[place].max(0.01);
    }
    object.yaw_variance = (object.yaw_variance * step.variance_factor).clamp(1e-4, 4.0);
    object.class = if step.is_truck { Class::Truck } else { Class::Car };
    object.class_probabilities = vec![(object.class, 1.0)];
    object.heading = if step.axis { HeadingKind::Axis } else { HeadingKind::Known };
}

/// The whole lists, one after the other.
fn lists(steps: &[Vec<Step>]) -> Vec<FusedFrame> {
    let mut objects: Vec<_> = (0..4).map(object).collect();
    let mut lists = Vec::new();
    for (sequence, steps) in (0..).zip(steps) {
        objects.iter_mut().zip(steps).for_each(|(object, step)| advance(object, step));
        let there = objects.iter().zip(steps).filter(|(_, step)| step.is_there);
        let elapsed = Span::from_nanos(INTERVAL.as_nanos() * i64::try_from(sequence).unwrap());
        lists.push(FusedFrame {
            hub: HubId::new("hub").unwrap(),
            sequence,
            fused_at: Timestamp::from_nanos(1_790_000_000_000_000_000) + elapsed,
            objects: there.map(|(object, _)| object.clone()).collect(),
            lineage: 7,
            map_frame: None,
            agents: Vec::new(),
            includes: Vec::new(),
        });
    }
    lists
}

/// What arrives of a message.
fn arrived(update: &ListUpdate, by_json: bool) -> ListUpdate {
    let mut bytes = Vec::new();
    match update {
        ListUpdate::Key(frame) if by_json => bytes = wire::json::encode_fused(frame).unwrap(),
        ListUpdate::Key(frame) => wire::fused::encode(frame, &mut bytes).unwrap(),
        ListUpdate::Delta(delta) if by_json => bytes = wire::json::encode_delta(delta).unwrap(),
        ListUpdate::Delta(delta) => wire::delta::encode(delta, &mut bytes).unwrap(),
    }
    wire::decode_update("", &bytes).unwrap()
}

/// As a hub does it: the key is what consumers have of it.
fn as_sent(list: &FusedFrame, by_json: bool) -> FusedFrame {
    match arrived(&ListUpdate::Key(list.clone()), by_json) {
        ListUpdate::Key(frame) => frame,
        ListUpdate::Delta(delta) => panic!("{delta:?} is no key frame"),
    }
}

/// The bounds that the documents state, restated here.
fn check_within(followed: &FusedFrame, whole: &FusedFrame) -> Result<(), TestCaseError> {
    let tracks = |frame: &FusedFrame| frame.objects.iter().map(|object| object.track).collect::<Vec<_>>();
    prop_assert_eq!((followed.sequence, tracks(followed)), (whole.sequence, tracks(whole)));
    prop_assert_eq!(followed.fused_at, whole.fused_at);
    for (a, b) in followed.objects.iter().zip(&whole.objects) {
        prop_assert_eq!((a.class, a.heading, a.age), (b.class, b.heading, b.age));
        let apart = libm::hypot(a.bev.x - b.bev.x, a.bev.y - b.bev.y);
        prop_assert!(apart <= 0.2 + RESOLUTION_M, "{apart} m");
        let faster = libm::hypot(a.velocity.0 - b.velocity.0, a.velocity.1 - b.velocity.1);
        prop_assert!(faster <= 0.5 + 1e-3, "{faster} m/s");
        prop_assert!(angle_difference(a.bev.yaw, b.bev.yaw).abs() <= 0.05 + 1e-4);
        prop_assert!((a.bev.w - b.bev.w).abs() <= 0.1 + 1e-3);
        prop_assert!((a.existence - b.existence).abs() <= 0.1 + 1.0 / 255.0);
        for place in KINEMATIC_DIAGONAL {
            let factor = a.kinematic_covariance[place] / b.kinematic_covariance[place];
            // A byte of the wire rounds σ up by 4.5 %.
            prop_assert!((0.24..=4.4).contains(&factor), "{factor}");
        }
        prop_assert!((0.24..=4.4).contains(&(a.yaw_variance / b.yaw_variance)));
    }
    Ok(())
}

proptest! {
    #[test]
    fn a_followed_list_is_within_the_tolerance_of_the_whole_one_whatever_is_lost(
        steps in vec(vec(step(), 4), 12), lost in vec(prop::bool::weighted(0.4), 12), by_json in any::<bool>()
    ) {
        let mut follower = DeltaFollower::default();
        let (mut key, mut has_key) = (FusedFrame { objects: Vec::new(), ..fixture::fused_frame() }, false);
        for (place, (list, is_lost)) in lists(&steps).iter().zip(lost).enumerate() {
            let update = if place % 5 == 0 {
                key = as_sent(list, by_json);
                has_key = !is_lost;
                ListUpdate::Key(list.clone())
            } else {
                ListUpdate::Delta(DeltaFrame::between(&key, list, &TOLERANCE))
            };
            if is_lost {
                continue;
            }
            match follower.handle(arrived(&update, by_json)) {
                Ok(followed) => check_within(followed, list)?,
                Err(FollowError::NoKey { .. } | FollowError::OtherKey { .. }) => prop_assert!(!has_key),
                Err(error) => prop_assert!(false, "{error}"),
            }
        }
    }
}

fn lists_of_one(n_lists: usize) -> Vec<FusedFrame> {
    let still = Step {
        shift: (0.0, 0.0),
        speed_up: (0.0, 0.0),
        turn: 0.0,
        growth: 0.0,
        existence: 0.0,
        variance_factor: 1.0,
        is_there: true,
        is_truck: false,
        axis: false,
    };
    lists(&vec![vec![still]; n_lists])
}

#[test]
fn what_moves_as_its_key_frame_says_is_not_sent_again() {
    let lists = lists_of_one(9);
    let delta = DeltaFrame::between(&lists[0], &lists[8], &TOLERANCE);
    assert!(delta.changed.is_empty() && delta.gone.is_empty(), "{delta:?}");
}

/// Each change alone, just within its tolerance and just beyond it.
#[test]
fn an_object_is_sent_again_exactly_when_one_of_its_numbers_is_beyond_the_tolerance() {
    type Change = (&'static str, fn(&mut FusedObject, f64));
    let changes: [Change; 14] = [
        ("x", |o, by| o.bev.x += 0.2 * by),
        ("y", |o, by| o.bev.y -= 0.2 * by),
        ("vx", |o, by| o.velocity.0 += 0.5 * by),
        ("vy", |o, by| o.velocity.1 -= 0.5 * by),
        ("w", |o, by| o.bev.w += 0.1 * by),
        ("d", |o, by| o.bev.d -= 0.1 * by),
        ("yaw", |o, by| o.bev.yaw -= 0.05 * by),
        ("existence", |o, by| o.existence -= 0.1 * by),
        ("conflict", |o, by| o.class_conflict += 0.1 * by),
        ("classes", |o, by| {
            o.class_probabilities = vec![(Class::Car, 1.0 - 0.1 * by), (Class::Truck, 0.1 * by)];
        }),
        ("ww", |o, by| o.ww *= 4.0 * by),
        ("dd", |o, by| o.dd /= 4.0 * by),
        ("yaw variance", |o, by| o.yaw_variance /= 4.0 * by),
        ("variance of vy", |o, by| o.kinematic_covariance[9] *= 4.0 * by),
    ];
    let lists = lists_of_one(2);
    for (name, change) in changes {
        for (by, is_sent) in [(0.999, false), (1.001, true)] {
            let mut list = lists[1].clone();
            change(&mut list.objects[0], by);
            let delta = DeltaFrame::between(&lists[0], &list, &TOLERANCE);
            assert_eq!(!delta.changed.is_empty(), is_sent, "{name} by {by} of its tolerance");
        }
    }
}

#[test]
fn a_class_that_one_of_two_lists_lacks_has_the_probability_0_there() {
    let with = |classes: &[(Class, f64)]| {
        let mut list = lists_of_one(1).remove(0);
        list.objects[0].class_probabilities = classes.to_vec();
        list
    };
    let (truck, bus) =
        ([(Class::Car, 0.85), (Class::Truck, 0.15)], [(Class::Car, 0.92), (Class::RigidBus, 0.08)]);
    for (key, list) in [(truck, bus), (bus, truck)] {
        assert_eq!(DeltaFrame::between(&with(&key), &with(&list), &TOLERANCE).changed.len(), 1);
    }
}

#[test]
fn a_correlation_that_changes_the_variance_of_a_direction_is_sent() {
    let mut lists = lists_of_one(2);
    lists[1].objects[0].kinematic_covariance[1] = 0.9;
    assert_eq!(DeltaFrame::between(&lists[0], &lists[1], &TOLERANCE).changed.len(), 1);
}

#[test]
fn class_and_kind_of_heading_are_never_different_and_an_unknown_heading_does_not_matter() {
    let changed = |change: fn(&mut FusedObject)| {
        let mut lists = lists_of_one(2);
        lists.iter_mut().for_each(|list| list.objects[0].heading = HeadingKind::Unknown);
        change(&mut lists[1].objects[0]);
        DeltaFrame::between(&lists[0], &lists[1], &TOLERANCE).changed.len()
    };
    assert_eq!(changed(|object| object.class = Class::Truck), 1);
    assert_eq!(changed(|object| object.heading = HeadingKind::Axis), 1);
    assert_eq!(changed(|object| object.bev.yaw += 1.0), 0);
}

#[test]
fn a_number_that_is_not_finite_is_sent_and_does_not_pass_for_another() {
    let mut lists = lists_of_one(2);
    lists[1].objects[0].bev.x = f64::NAN;
    assert_eq!(DeltaFrame::between(&lists[0], &lists[1], &TOLERANCE).changed.len(), 1);
    lists[0].objects[0].kinematic_covariance = [f64::NAN; 10];
    assert_eq!(DeltaFrame::between(&lists[0], &lists[0], &TOLERANCE).changed.len(), 1);
}

#[test]
fn messages_that_do_not_move_the_list_on_are_refused_and_leave_it_as_it_was() {
    let lists = lists_of_one(7);
    let delta = |key: usize, list: usize| {
        ListUpdate::Delta(DeltaFrame::between(&lists[key], &lists[list], &TOLERANCE))
    };
    let key = |list: usize| ListUpdate::Key(lists[list].clone());
    let mut follower = DeltaFollower::default();
    assert!(matches!(follower.handle(delta(0, 1)), Err(FollowError::NoKey { .. })));
    assert_eq!(follower.list(), None);
    assert!(follower.handle(key(2)).is_ok() && follower.handle(delta(2, 4)).is_ok());
    let (held, at_4) = (follower.list().unwrap().sequence, follower.list().cloned());
    assert_eq!(held, 4);
    for stale in [delta(2, 4), delta(2, 3), key(1), key(4)] {
        assert!(matches!(follower.handle(stale), Err(FollowError::NotNewer { .. })));
    }
    let error = follower.handle(delta(5, 6)).unwrap_err();
    assert!(matches!(error, FollowError::OtherKey { .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "delta frame 6 of hub (00000007) is relative to key frame 5, the newest one is 2 of hub (00000007)"
    );
    assert_eq!(follower.list().cloned(), at_4);
}

#[test]
fn after_a_restart_of_the_hub_a_list_is_followed_from_its_first_key_frame_on() {
    let mut lists = lists_of_one(3);
    let mut follower = DeltaFollower::default();
    follower.handle(ListUpdate::Key(lists[2].clone())).unwrap();
    lists.iter_mut().for_each(|list| list.lineage = 8);
    let delta = || ListUpdate::Delta(DeltaFrame::between(&lists[0], &lists[1], &TOLERANCE));
    assert!(matches!(follower.handle(delta()), Err(FollowError::OtherKey { .. })));
    assert!(follower.handle(ListUpdate::Key(lists[0].clone())).is_ok() && follower.handle(delta()).is_ok());
}

fn tile_frame(sequence: u64, tracks: &[u32]) -> FusedFrame {
    let mut frame = lists_of_one(1).remove(0);
    frame.sequence = sequence;
    frame.fused_at += Span::from_millis(100 * i64::try_from(sequence).unwrap());
    frame.objects = tracks.iter().map(|track| object(*track)).collect();
    frame
}

fn tracks(follower: &AreaFollower) -> Vec<u32> {
    follower.list().unwrap().objects.iter().map(|object| object.track.counter()).collect()
}

#[test]
fn an_area_is_the_newest_frame_of_each_of_its_tiles() {
    let (west, east) = ("120".parse().unwrap(), "121".parse().unwrap());
    let mut area = AreaFollower::default();
    assert_eq!(area.list(), None);
    area.handle(west, tile_frame(1, &[3, 5])).unwrap();
    area.handle(east, tile_frame(1, &[4])).unwrap();
    assert_eq!(tracks(&area), [3, 4, 5]);
    // Track 5 crosses the edge: for a moment it is in both frames.
    area.handle(east, tile_frame(2, &[4, 5])).unwrap();
    assert_eq!((tracks(&area), area.list().unwrap().sequence), (vec![3, 4, 5], 2));
    area.handle(west, tile_frame(2, &[])).unwrap();
    assert_eq!(tracks(&area), [4, 5]);
    assert!(matches!(area.handle(west, tile_frame(2, &[9])), Err(FollowError::NotNewer { .. })));
    assert_eq!(tracks(&area), [4, 5]);
}

#[test]
fn an_object_of_two_tiles_is_as_the_newer_frame_has_it() {
    let (west, east) = ("120".parse().unwrap(), "121".parse().unwrap());
    for newer_first in [false, true] {
        let mut area = AreaFollower::default();
        let mut newer = tile_frame(2, &[5]);
        newer.objects[0].bev.x = 77.0;
        let (first, second) =
            if newer_first { (newer.clone(), tile_frame(1, &[5])) } else { (tile_frame(1, &[5]), newer) };
        area.handle(west, first).unwrap();
        area.handle(east, second).unwrap();
        let list = area.list().unwrap();
        assert_eq!((list.objects.len(), list.objects[0].bev.x, list.sequence), (1, 77.0, 2));
    }
}

#[test]
fn a_tile_of_which_nothing_comes_for_long_is_forgotten_and_so_is_the_hubs_earlier_run() {
    let (west, east) = ("120".parse().unwrap(), "121".parse().unwrap());
    let mut area = AreaFollower::default();
    area.handle(west, tile_frame(1, &[3])).unwrap();
    area.handle(east, tile_frame(16, &[4])).unwrap();
    assert_eq!(tracks(&area), [3, 4], "1.5 s");
    area.handle(east, tile_frame(17, &[4])).unwrap();
    assert_eq!(tracks(&area), [4], "1.6 s");
    area.handle(west, FusedFrame { lineage: 8, ..tile_frame(0, &[6]) }).unwrap();
    assert_eq!(tracks(&area), [6]);
}
