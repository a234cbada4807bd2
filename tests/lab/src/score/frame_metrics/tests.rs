use super::*;
use crate::data::fixture::{parked, predicted};
use crate::data::scene::TrueBox;
use crate::score::estimate::Estimate;
use crate::score::fixture::estimate;
use crate::score::matching::Outcome::{False, Ignored, Matched};
use std::f64::consts::PI;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::BevBox;

fn of_box(bev: BevBox) -> Estimate {
    Estimate { bev, ..estimate(0.0, 0.0) }
}

fn car(id: u32, x: f64) -> TrueBox {
    TrueBox::from(&parked(id, x, 0.0))
}

fn scored(estimates: &[Estimate], truth: &[TrueBox], outcomes: &[Outcome], missed: &[usize]) -> FrameMetrics {
    let matching = Matching { outcomes: outcomes.to_vec(), missed: missed.to_vec() };
    let frame = Frame { estimates, truth, counts: &vec![true; truth.len()] };
    frame_metrics(&frame, &matching, 2.0, &mut Assigner::default())
}

#[test]
fn errors_are_means_over_the_pairs_of_the_frame() {
    let truth = [car(0, 0.0), car(1, 10.0)];
    let far = of_box(BevBox { x: 10.0, y: 1.0, w: 2.3, d: 4.4, yaw: 0.0 });
    let near = of_box(BevBox { x: 0.3, y: 0.4, w: 2.0, d: 4.0, yaw: PI / 6.0 });
    let frame = scored(&[far, near], &truth, &[Matched(1), Matched(0)], &[]);
    let close =
        |value: Option<f64>, expected: f64| assert!((value.unwrap() - expected).abs() < 1e-12, "{value:?}");
    let means = frame.sums.mean_of_matched().unwrap();
    for (mean, expected) in means.into_iter().zip([0.75, 0.25, 15.0]) {
        close(Some(mean), expected);
    }
    // (1 / 0.25 + 0.25 / 0.25) / 2 / 2
    close(frame.nees_position, 1.25);
    close(Some(frame.gospa.distance_m()), libm::sqrt(1.25));
}

#[test]
fn heading_errors_are_the_shorter_angle_up_to_180_degrees() {
    let truth = [TrueBox { bev: BevBox { yaw: PI - 0.05, ..predicted(0.0, 0.0) }, ..car(0, 0.0) }];
    let across = of_box(BevBox { yaw: -PI + 0.05, ..predicted(0.0, 0.0) });
    let frame = scored(&[across], &truth, &[Matched(0)], &[]);
    assert!((frame.sums.mean_of_matched().unwrap()[2] - 0.1f64.to_degrees()).abs() < 1e-9);
    let backwards = of_box(BevBox { yaw: -0.05, ..predicted(0.0, 0.0) });
    let frame = scored(&[backwards], &truth, &[Matched(0)], &[]);
    assert!((frame.sums.mean_of_matched().unwrap()[2] - 180.0).abs() < 1e-9);
}

#[test]
fn correlated_position_errors_are_weighted_by_the_whole_covariance() {
    let position = Covariance2 { xx: 2.0, xy: 1.0, yy: 2.0 };
    let truth = [car(0, 0.0)];
    let nees = |x, y| {
        let says = Estimate { class: Class::Car, bev: predicted(x, y), position };
        scored(&[says], &truth, &[Matched(0)], &[]).nees_position.unwrap()
    };
    // S⁻¹ = [2 -1; -1 2] / 3: along the diagonal (1, 1) 2/3, across it (1, -1) 6/3.
    assert!((nees(1.0, 1.0) - 1.0 / 3.0).abs() < 1e-12);
    assert!((nees(1.0, -1.0) - 1.0).abs() < 1e-12);
}

#[test]
fn ignored_estimates_enter_no_metric() {
    let truth = [car(0, 0.0), car(1, 9.0), car(2, 90.0)];
    let says = [predicted(0.0, 0.0), predicted(90.9, 0.0), predicted(50.0, 0.0)].map(of_box);
    let frame = scored(&says, &truth, &[Matched(0), Ignored, False], &[1]);
    assert_eq!((frame.sums.true_positives, frame.sums.false_positives, frame.sums.missed), (1, 1, 1));
    assert_eq!((frame.sums.precision(), frame.sums.recall()), (Some(0.5), Some(0.5)));
    assert_eq!(frame.ate_m(), Some(0.0));
    assert_eq!(frame.gospa, GospaParts { localisation_m2: 0.0, missed_m2: 2.0, false_m2: 2.0 });
}

#[test]
fn frames_weigh_equally_however_many_objects_they_have() {
    let truth = [car(0, 0.0), car(1, 10.0), car(2, 20.0)];
    let exact = [0.0, 10.0, 20.0].map(|x| of_box(predicted(x, 0.0)));
    let off = [of_box(predicted(0.0, 1.0)), of_box(predicted(70.0, 0.0))];
    let mut tally = Tally::default();
    tally.add(&scored(&exact, &truth, &[Matched(0), Matched(1), Matched(2)], &[]));
    tally.add(&scored(&off, &truth[..1], &[Matched(0), False], &[]));
    let metrics = tally.metrics();
    assert_eq!((metrics.ate_m, metrics.precision, metrics.recall), (Some(0.5), Some(0.75), Some(1.0)));
    assert_eq!((metrics.true_positives, metrics.false_positives, metrics.false_negatives), (4, 1, 0));
    assert_eq!(metrics.frames, 2);
    // Frames of 0 m and sqrt(1 + 2) m.
    assert!((metrics.gospa_m.unwrap() - libm::sqrt(3.0) / 2.0).abs() < 1e-12);
    let parts = GospaParts { localisation_m2: 0.5, missed_m2: 0.0, false_m2: 1.0 };
    assert_eq!(metrics.gospa_parts, Some(parts));
}

#[test]
fn figures_without_data_are_null_in_json() {
    let mut tally = Tally::default();
    tally.add(&scored(&[], &[], &[], &[]));
    let json = serde_json::to_value(tally.metrics()).unwrap();
    for name in
        ["ate_m", "ade_m", "aoe_deg", "precision", "recall", "gospa_m", "gospa_parts", "nees_position"]
    {
        assert!(json[name].is_null(), "{name} is {}", json[name]);
    }
    assert_eq!(json["frames"], 1);
}

#[test]
fn a_frame_with_only_misses_has_recall_zero_and_no_error() {
    let mut tally = Tally::default();
    tally.add(&scored(&[], &[car(0, 0.0)], &[], &[0]));
    let metrics = tally.metrics();
    assert_eq!((metrics.recall, metrics.precision, metrics.ate_m), (Some(0.0), None, None));
    assert_eq!(metrics.gospa_m, Some(libm::sqrt(2.0)));
}

#[test]
fn a_position_without_a_valid_covariance_has_no_consistency() {
    let says = Estimate { class: Class::Car, bev: predicted(0.0, 0.0), position: Covariance2::default() };
    let frame = scored(&[says], &[car(0, 0.0)], &[Matched(0)], &[]);
    assert_eq!((frame.nees_position, frame.ate_m()), (None, Some(0.0)));
}
