use super::*;
use crate::data::fixture::{parked, predicted};
use crate::score::matching::Outcome::{False, Ignored, Matched};
use std::f64::consts::PI;

fn prediction(bev: BevBox) -> Prediction {
    Prediction { bev, position: Covariance2::isotropic(0.5) }
}

fn judge(
    predictions: &[Prediction],
    truth: &[TrueObject],
    outcomes: &[Outcome],
    missed: &[usize],
) -> FrameMetrics {
    let matching = Matching { outcomes: outcomes.to_vec(), missed: missed.to_vec() };
    frame_metrics(predictions, truth, &matching, 2.0, &mut Assigner::default())
}

#[test]
fn errors_are_means_over_the_pairs_of_the_frame() {
    let truth = [parked(0, 0.0, 0.0), parked(1, 10.0, 0.0)];
    let far = prediction(BevBox { x: 10.0, y: 1.0, w: 2.3, d: 4.4, yaw: 0.0 });
    let near = prediction(BevBox { x: 0.3, y: 0.4, w: 2.0, d: 4.0, yaw: PI / 6.0 });
    let frame = judge(&[far, near], &truth, &[Matched(1), Matched(0)], &[]);
    let close =
        |value: Option<f64>, expected: f64| assert!((value.unwrap() - expected).abs() < 1e-12, "{value:?}");
    close(frame.ate_m, 0.75);
    close(frame.ade_m, 0.25);
    close(frame.aoe_deg, 15.0);
    // (1 / 0.25 + 0.25 / 0.25) / 2 / 2
    close(frame.nees_position, 1.25);
    close(Some(frame.gospa.distance_m()), libm::sqrt(1.25));
}

#[test]
fn heading_errors_take_the_shorter_way_and_reach_180_degrees() {
    let truth = [TrueObject { bev: BevBox { yaw: PI - 0.05, ..predicted(0.0, 0.0) }, ..parked(0, 0.0, 0.0) }];
    let across = prediction(BevBox { yaw: -PI + 0.05, ..predicted(0.0, 0.0) });
    let frame = judge(&[across], &truth, &[Matched(0)], &[]);
    assert!((frame.aoe_deg.unwrap() - 0.1f64.to_degrees()).abs() < 1e-9);
    let backwards = prediction(BevBox { yaw: -0.05, ..predicted(0.0, 0.0) });
    let frame = judge(&[backwards], &truth, &[Matched(0)], &[]);
    assert!((frame.aoe_deg.unwrap() - 180.0).abs() < 1e-9);
}

#[test]
fn correlated_position_errors_are_weighted_by_the_whole_covariance() {
    let position = Covariance2 { xx: 2.0, xy: 1.0, yy: 2.0 };
    let truth = [parked(0, 0.0, 0.0)];
    let nees = |x, y| {
        let says = Prediction { bev: predicted(x, y), position };
        judge(&[says], &truth, &[Matched(0)], &[]).nees_position.unwrap()
    };
    // S⁻¹ = [2 -1; -1 2] / 3: along the diagonal (1, 1) 2/3, across it (1, -1) 6/3.
    assert!((nees(1.0, 1.0) - 1.0 / 3.0).abs() < 1e-12);
    assert!((nees(1.0, -1.0) - 1.0).abs() < 1e-12);
}

#[test]
fn what_counts_neither_way_enters_no_figure() {
    let truth = [parked(0, 0.0, 0.0), parked(1, 9.0, 0.0), parked(2, 90.0, 0.0)];
    let says = [predicted(0.0, 0.0), predicted(90.9, 0.0), predicted(50.0, 0.0)].map(prediction);
    let frame = judge(&says, &truth, &[Matched(0), Ignored, False], &[1]);
    assert_eq!((frame.true_positives, frame.false_positives, frame.false_negatives), (1, 1, 1));
    assert_eq!((frame.precision(), frame.recall()), (Some(0.5), Some(0.5)));
    assert_eq!(frame.ate_m, Some(0.0));
    assert_eq!(frame.gospa, GospaParts { localisation_m2: 0.0, missed_m2: 2.0, false_m2: 2.0 });
}

#[test]
fn frames_weigh_equally_however_many_objects_they_have() {
    let truth = [parked(0, 0.0, 0.0), parked(1, 10.0, 0.0), parked(2, 20.0, 0.0)];
    let exact = [0.0, 10.0, 20.0].map(|x| prediction(predicted(x, 0.0)));
    let off = [prediction(predicted(0.0, 1.0)), prediction(predicted(70.0, 0.0))];
    let mut tally = Tally::default();
    tally.add(&judge(&exact, &truth, &[Matched(0), Matched(1), Matched(2)], &[]));
    tally.add(&judge(&off, &truth[..1], &[Matched(0), False], &[]));
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
    tally.add(&judge(&[], &[], &[], &[]));
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
    tally.add(&judge(&[], &[parked(0, 0.0, 0.0)], &[], &[0]));
    let metrics = tally.metrics();
    assert_eq!((metrics.recall, metrics.precision, metrics.ate_m), (Some(0.0), None, None));
    assert_eq!(metrics.gospa_m, Some(libm::sqrt(2.0)));
}

#[test]
fn a_position_without_a_valid_covariance_has_no_consistency() {
    let says = Prediction { bev: predicted(0.0, 0.0), position: Covariance2::default() };
    let frame = judge(&[says], &[parked(0, 0.0, 0.0)], &[Matched(0)], &[]);
    assert_eq!((frame.nees_position, frame.ate_m), (None, Some(0.0)));
}
