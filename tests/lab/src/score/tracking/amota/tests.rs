use super::*;
use crate::score::tracking::sequence::{Instant, ReportedBox};
use crate::score::tracking::testing::{Xs, instant, reported, sequence, truth};
use v2x_common::class::Class;

const CAR: TrackingClass = TrackingClass::Car;

#[test]
fn estimates_equal_to_the_truth_score_1() {
    let exact: Xs = (&[(0, 0.0), (1, 9.0)], &[(7, 0.0), (8, 9.0)]);
    let scene = sequence(&[exact; 10]);
    let score = NuscenesScore::of(&[scene.clone(), scene]);
    assert_eq!((score.amota(), score.amotp_m()), (Some(1.0), Some(0.0)));
    let best = score.classes[0].1.best.unwrap();
    assert_eq!((score.classes.len(), best.found, score.classes[0].1.recall()), (1, 40, 1.0));
}

#[test]
fn recalls_that_are_not_reached_count_with_motar_zero_and_two_metres() {
    let missed: Xs = (&[(0, 0.0)], &[]);
    let found: Xs = (&[(0, 0.0)], &[(7, 1.0)]);
    // Recall 0.5: of the 40 recalls from 0.1 by 0.9 / 39 the first 18.
    let score = NuscenesScore::of(&[sequence(&[found, found, missed, missed])]);
    assert_eq!(score.amota(), Some(18.0 / 40.0));
    assert_eq!(score.amotp_m(), Some((18.0 + 2.0 * 22.0) / 40.0));
    assert_eq!((score.classes[0].1.mota(), score.classes[0].1.motar()), (0.5, 1.0));
}

#[test]
fn a_false_track_of_low_score_costs_only_the_recalls_that_need_it() {
    let scored = |track, x, score| ReportedBox { score, ..reported(track, x) };
    let both = Instant {
        truth: vec![truth(0, 0.0), truth(1, 9.0)],
        reported: vec![scored(7, 0.0, 0.9), scored(8, 9.0, 0.3), scored(9, 30.0, 0.5)],
    };
    let score = NuscenesScore::of(&[Sequence::new(vec![both; 4]).unwrap()]);
    // Up to recall 0.5 the second object's track is not needed. Beyond it the false track costs a half.
    let amota = score.amota().unwrap();
    assert!((0.5 * 22.0 / 40.0 + 18.0 / 40.0 - amota).abs() < 0.05, "{amota}");
    assert!(amota < 1.0 && amota > 0.5);
}

#[test]
fn the_score_of_a_track_is_the_mean_of_its_boxes() {
    let scored = |x, score| Instant {
        truth: vec![truth(0, x)],
        reported: vec![ReportedBox { score, ..reported(7, x) }],
    };
    let of = |scores: [f64; 2]| {
        let mut instants: Vec<_> = scores.map(|score| scored(0.0, score)).to_vec();
        // A false track with a score of 0.5 at both instants.
        instants
            .iter_mut()
            .for_each(|one| one.reported.push(ReportedBox { score: 0.5, ..reported(8, 50.0) }));
        NuscenesScore::of(&[Sequence::new(instants).unwrap()]).amota()
    };
    assert_eq!(of([0.9, 0.3]), of([0.6, 0.6]));
    assert_ne!(of([0.9, 0.3]), of([0.3, 0.3]));
}

#[test]
fn gaps_in_tracks_are_filled_whatever_the_class_after_them() {
    let mut bus = instant(&[(0, 0.0)], &[(7, 0.0)]);
    bus.reported[0].class = Class::RigidBus;
    let car = instant(&[(0, 0.0)], &[(7, 0.0)]);
    let hole = instant(&[(0, 0.0)], &[]);
    let found = |instants: Vec<Instant>| {
        let score = NuscenesScore::of(&[Sequence::new(instants).unwrap()]);
        assert_eq!(score.classes[0].0, CAR);
        score.classes[0].1.best.map(|best| best.found)
    };
    assert_eq!(found(vec![car.clone(), hole.clone(), hole.clone(), car.clone()]), Some(4));
    assert_eq!(found(vec![bus.clone(), hole.clone(), car.clone()]), Some(2));
    assert_eq!(found(vec![car, hole, bus]), Some(1));
}

#[test]
fn classes_without_objects_and_those_outside_the_seven_do_not_count() {
    let mut barrier = instant(&[(0, 0.0)], &[(7, 0.0)]);
    barrier.truth[0].class = Class::Barrier;
    assert_eq!(NuscenesScore::of(&[Sequence::new(vec![barrier]).unwrap()]).amota(), None);
    let silent = NuscenesScore::of(&[sequence(&[(&[(0, 0.0)], &[])])]);
    assert_eq!((silent.amota(), silent.amotp_m()), (Some(0.0), Some(2.0)));
    assert_eq!(silent.classes[0].1.best, None);
}
