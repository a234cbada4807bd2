//! What is decoded is what was encoded, within the wire's resolution; encoded again it is the same bytes.

use crate::strategy;
use proptest::prelude::*;
use v2x_common::covariance::{Covariance2, Velocity};
use v2x_common::detection::{Detection, DetectionFrame, MAX_RANGE_M, MAX_SIGMA_M, MAX_SIGMA_YAW_RAD};
use v2x_common::fused::{FusedObject, KINEMATIC_DIAGONAL, KINEMATIC_INDEX};
use v2x_common::geometry::{BevBox, Pose, angle_difference};
use v2x_common::wire::{delta, detections, fused, sensor};

/// Half a millimetre, and the rounding of f64 at 1e8 m.
const POSITION_TOLERANCE_M: f64 = 0.5e-3 + 4e-8;
const SIZE_TOLERANCE_M: f64 = 0.5e-3 + 1e-12;
const YAW_TOLERANCE_RAD: f64 = 0.05e-3 + 1e-12;
/// Half of one of 255 steps.
const PROBABILITY_TOLERANCE: f64 = 0.5 / 255.0 + 1e-12;
const SIGMA_GROWTH: f64 = 1.045;
/// One step of cutting, and four of shrinking: cutting moves no eigenvalue by more than 3/128.
const KINEMATIC_RHO_TOLERANCE: f64 = 5.0 / 128.0 + 1e-9;

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

fn sigma_is_rounded_up(sent: f64, got: f64) -> bool {
    let growth = libm::sqrt(got) / libm::sqrt(sent);
    (1.0 - 1e-11..=SIGMA_GROWTH).contains(&growth)
}

fn rho_is_cut_toward_zero(sent: f64, got: f64) -> bool {
    let cut = (sent - got) * sent.signum();
    (-1e-10..1.0 / 128.0).contains(&cut) && got * sent >= 0.0
}

fn rho(covariance: &Covariance2) -> f64 {
    covariance.xy / libm::sqrt(covariance.xx * covariance.yy)
}

fn check_bev(sent: &BevBox, got: &BevBox) -> Result<(), TestCaseError> {
    prop_assert!(near(got.x, sent.x, POSITION_TOLERANCE_M), "x {} {}", sent.x, got.x);
    prop_assert!(near(got.y, sent.y, POSITION_TOLERANCE_M), "y {} {}", sent.y, got.y);
    prop_assert!(near(got.w, sent.w, SIZE_TOLERANCE_M), "w {} {}", sent.w, got.w);
    prop_assert!(near(got.d, sent.d, SIZE_TOLERANCE_M), "d {} {}", sent.d, got.d);
    check_yaw(sent.yaw, got.yaw)
}

fn check_yaw(sent: f64, got: f64) -> Result<(), TestCaseError> {
    let turn = angle_difference(got, sent);
    prop_assert!(near(turn, 0.0, YAW_TOLERANCE_RAD), "yaw {} {}", sent, got);
    prop_assert!(got > -std::f64::consts::PI && got <= std::f64::consts::PI, "yaw {} out of range", got);
    Ok(())
}

fn check_covariance(sent: &Covariance2, got: &Covariance2) -> Result<(), TestCaseError> {
    prop_assert!(sigma_is_rounded_up(sent.xx, got.xx), "xx {} {}", sent.xx, got.xx);
    prop_assert!(sigma_is_rounded_up(sent.yy, got.yy), "yy {} {}", sent.yy, got.yy);
    prop_assert!(rho_is_cut_toward_zero(rho(sent), rho(got)), "rho {} {}", rho(sent), rho(got));
    prop_assert!(got.is_valid());
    Ok(())
}

fn check_velocity(sent: &Velocity, got: &Velocity) -> Result<(), TestCaseError> {
    prop_assert!(near(got.x, sent.x, SIZE_TOLERANCE_M) && near(got.y, sent.y, SIZE_TOLERANCE_M));
    check_covariance(&sent.covariance, &got.covariance)
}

fn check_detection(sent: &Detection, got: &Detection) -> Result<(), TestCaseError> {
    prop_assert_eq!((sent.class, sent.source_track), (got.class, got.source_track));
    prop_assert!(near(got.score, sent.score, PROBABILITY_TOLERANCE));
    check_bev(&sent.bev, &got.bev)?;
    check_covariance(&sent.covariance.position, &got.covariance.position)?;
    prop_assert!(sigma_is_rounded_up(sent.covariance.ww, got.covariance.ww));
    prop_assert!(sigma_is_rounded_up(sent.covariance.dd, got.covariance.dd));
    prop_assert!(sigma_is_rounded_up(sent.covariance.yaw, got.covariance.yaw));
    prop_assert_eq!(sent.velocity.is_some(), got.velocity.is_some());
    match (&sent.velocity, &got.velocity) {
        (Some(sent), Some(got)) => check_velocity(sent, got),
        _ => Ok(()),
    }
}

fn check_pose(sent: &Pose, got: &Pose) -> Result<(), TestCaseError> {
    prop_assert!(near(got.x, sent.x, POSITION_TOLERANCE_M) && near(got.y, sent.y, POSITION_TOLERANCE_M));
    check_yaw(sent.yaw, got.yaw)
}

fn check_object(sent: &FusedObject, got: &FusedObject) -> Result<(), TestCaseError> {
    prop_assert_eq!((sent.track, sent.class, sent.age), (got.track, got.class, got.age));
    prop_assert_eq!(sent.last_measured_at, got.last_measured_at);
    prop_assert_eq!(&sent.contributors, &got.contributors);
    prop_assert!((sent.class_conflict - got.class_conflict).abs() <= 0.5 / 255.0 + 1e-12);
    prop_assert_eq!(sent.class_probabilities.len(), got.class_probabilities.len());
    for ((class, p), (got_class, got_p)) in sent.class_probabilities.iter().zip(&got.class_probabilities) {
        prop_assert_eq!(class, got_class);
        prop_assert!(near(*p, *got_p, PROBABILITY_TOLERANCE));
    }
    check_bev(&sent.bev, &got.bev)?;
    prop_assert!(near(got.velocity.0, sent.velocity.0, SIZE_TOLERANCE_M));
    prop_assert!(near(got.velocity.1, sent.velocity.1, SIZE_TOLERANCE_M));
    prop_assert!(near(got.existence, sent.existence, PROBABILITY_TOLERANCE));
    for (sent, got) in [(sent.ww, got.ww), (sent.dd, got.dd), (sent.yaw_variance, got.yaw_variance)] {
        prop_assert!(sigma_is_rounded_up(sent, got));
    }
    for place in KINEMATIC_DIAGONAL {
        prop_assert!(sigma_is_rounded_up(sent.kinematic_covariance[place], got.kinematic_covariance[place]));
    }
    prop_assert!(is_positive_definite(got), "{:?}", got.kinematic_covariance);
    for ((row, column), (sent_rho, got_rho)) in KINEMATIC_INDEX.into_iter().zip(correlations(sent, got)) {
        prop_assert!(near(sent_rho, got_rho, KINEMATIC_RHO_TOLERANCE), "{row} {column} {sent_rho} {got_rho}");
    }
    Ok(())
}

fn correlations(sent: &FusedObject, got: &FusedObject) -> [(f64, f64); 10] {
    let (sent, got) = (sent.kinematic_covariance, got.kinematic_covariance);
    std::array::from_fn(|place| {
        let (row, column) = KINEMATIC_INDEX[place];
        let diagonal = (KINEMATIC_DIAGONAL[row], KINEMATIC_DIAGONAL[column]);
        let [sent, got] = [sent, got].map(|c| c[place] / libm::sqrt(c[diagonal.0] * c[diagonal.1]));
        (sent, got)
    })
}

/// By Gauss's elimination: all pivots are positive.
pub(crate) fn is_positive_definite(object: &FusedObject) -> bool {
    let mut matrix = [[0.0; 4]; 4];
    for (value, (row, column)) in object.kinematic_covariance.into_iter().zip(KINEMATIC_INDEX) {
        matrix[row][column] = value;
        matrix[column][row] = value;
    }
    for k in 0..4 {
        let pivot_row = matrix[k];
        if pivot_row[k].is_nan() || pivot_row[k] <= 0.0 {
            return false;
        }
        for row in &mut matrix[k + 1..] {
            let factor = row[k] / pivot_row[k];
            row.iter_mut().zip(pivot_row).for_each(|(value, above)| *value -= factor * above);
        }
    }
    true
}

fn encoded(frame: &DetectionFrame) -> Vec<u8> {
    let mut bytes = Vec::new();
    detections::encode(frame, &mut bytes).unwrap();
    bytes
}

proptest! {
    #[test]
    fn a_detection_frame_comes_back_within_the_resolution_and_is_then_stable(
        frame in strategy::detection_frame()
    ) {
        let bytes = encoded(&frame);
        let got = detections::decode(&bytes).unwrap();
        prop_assert_eq!(
            (&frame.id, frame.captured_at, frame.sensor_revision, frame.map_frame),
            (&got.id, got.captured_at, got.sensor_revision, got.map_frame)
        );
        prop_assert_eq!(frame.sensor_pose.is_some(), got.sensor_pose.is_some());
        if let (Some(sent), Some(got)) = (&frame.sensor_pose, &got.sensor_pose) {
            check_pose(sent, got)?;
        }
        prop_assert_eq!(frame.detections.len(), got.detections.len());
        for (sent, got) in frame.detections.iter().zip(&got.detections) {
            check_detection(sent, got)?;
        }
        prop_assert_eq!(encoded(&got), bytes);
    }

    #[test]
    fn a_fused_frame_comes_back_within_the_resolution_and_is_then_stable(frame in strategy::fused_frame()) {
        let mut bytes = Vec::new();
        fused::encode(&frame, &mut bytes).unwrap();
        let got = fused::decode(&bytes).unwrap();
        prop_assert_eq!(
            (frame.hub, frame.lineage, frame.sequence, frame.fused_at, frame.map_frame),
            (got.hub, got.lineage, got.sequence, got.fused_at, got.map_frame)
        );
        prop_assert_eq!(&frame.agents, &got.agents);
        prop_assert_eq!(&frame.includes, &got.includes);
        prop_assert_eq!(frame.objects.len(), got.objects.len());
        for (sent, got) in frame.objects.iter().zip(&got.objects) {
            check_object(sent, got)?;
        }
        let mut again = Vec::new();
        fused::encode(&got, &mut again).unwrap();
        prop_assert_eq!(again, bytes);
    }

    #[test]
    fn a_delta_frame_comes_back_within_the_resolution_and_is_then_stable(frame in strategy::delta_frame()) {
        let mut bytes = Vec::new();
        delta::encode(&frame, &mut bytes).unwrap();
        let got = delta::decode(&bytes).unwrap();
        prop_assert_eq!(
            (frame.hub, frame.lineage, frame.sequence, frame.fused_at, frame.map_frame),
            (got.hub, got.lineage, got.sequence, got.fused_at, got.map_frame)
        );
        prop_assert_eq!((frame.key_sequence, &frame.gone), (got.key_sequence, &got.gone));
        prop_assert_eq!(frame.changed.len(), got.changed.len());
        for (sent, got) in frame.changed.iter().zip(&got.changed) {
            check_object(sent, got)?;
        }
        let mut again = Vec::new();
        delta::encode(&got, &mut again).unwrap();
        prop_assert_eq!(again, bytes);
    }

    #[test]
    fn a_sensor_description_comes_back_exactly(description in strategy::sensor_description()) {
        let mut bytes = Vec::new();
        sensor::encode(&description, &mut bytes).unwrap();
        prop_assert_eq!(sensor::decode(&bytes).unwrap(), description);
    }

    /// Rounding must not move a value beyond a limit that the receiver checks.
    #[test]
    fn what_can_be_encoded_at_the_limit_of_range_can_be_decoded(
        sensor_x in -2.0..2.0f64, beyond in -2e-3..2e-3f64, utm in any::<bool>()
    ) {
        let sensor_x = if utm { 500_000.0 + sensor_x } else { sensor_x };
        let mut frame = crate::fixture::detection_frame();
        frame.sensor_pose = Some(Pose { x: sensor_x, ..frame.sensor_pose.unwrap() });
        for (detection, sign) in frame.detections.iter_mut().zip([1.0, -1.0, 1.0]) {
            detection.bev.x = sensor_x + sign * (MAX_RANGE_M + beyond);
        }
        let mut bytes = Vec::new();
        let sent = detections::encode(&frame, &mut bytes);
        // Sensor and detection are rounded by half a millimetre each.
        prop_assert!(sent.is_ok() || beyond > -1.1e-3, "{sent:?}");
        prop_assert!(sent.is_err() || detections::decode(&bytes).is_ok(), "{:?}", detections::decode(&bytes));
    }
}

#[test]
fn an_empty_frame_survives_encoding() {
    let mut frame = crate::fixture::detection_frame();
    frame.detections.clear();
    assert_eq!(detections::decode(&encoded(&frame)).unwrap(), frame);
    frame.sensor_pose = None;
    frame.map_frame = None;
    assert_eq!(detections::decode(&encoded(&frame)).unwrap(), frame);
}

#[test]
fn the_largest_valid_variances_survive_encoding() {
    let mut frame = crate::fixture::detection_frame();
    let variance = MAX_SIGMA_M * MAX_SIGMA_M;
    let covariance = &mut frame.detections[0].covariance;
    covariance.position = Covariance2::isotropic(MAX_SIGMA_M);
    (covariance.ww, covariance.dd) = (variance, variance);
    covariance.yaw = MAX_SIGMA_YAW_RAD * MAX_SIGMA_YAW_RAD;
    let got = detections::decode(&encoded(&frame)).unwrap().detections[0].covariance;
    assert!(near(got.position.xx, variance, 1e-9) && near(got.ww, variance, 1e-9), "{got:?}");
}

#[test]
fn half_a_turn_has_one_encoding_whatever_its_sign() {
    let mut frame = crate::fixture::detection_frame();
    let mut bytes = [std::f64::consts::PI, -std::f64::consts::PI].map(|yaw| {
        frame.detections[0].bev.yaw = yaw;
        encoded(&frame)
    });
    assert_eq!(bytes[0], bytes[1]);
    bytes[0] = encoded(&detections::decode(&bytes[1]).unwrap());
    assert_eq!(bytes[0], bytes[1]);
}

/// The bytes of the position's covariance stand six before the end of a frame of one plain detection.
#[test]
fn every_covariance_that_can_be_decoded_is_positive_definite() {
    let mut frame = crate::fixture::detection_frame();
    frame.detections.truncate(1);
    frame.detections[0].velocity = None;
    let mut bytes = encoded(&frame);
    let place = bytes.len() - 6;
    let mut check = |sx: u8, sy: u8, rho: u8| {
        bytes[place..place + 3].copy_from_slice(&[sx, sy, rho]);
        let got = detections::decode(&bytes).expect("all sigmas and correlations are legal");
        assert!(got.detections[0].covariance.position.is_valid(), "{sx} {sy} {rho}");
    };
    let extremes = [-128i8, -127, 0, 127].map(i8::cast_unsigned);
    for sx in 0..=u8::MAX {
        (0..=u8::MAX).for_each(|sy| extremes.into_iter().for_each(|rho| check(sx, sy, rho)));
        (0..=u8::MAX).for_each(|rho| [0, sx, 255].into_iter().for_each(|sy| check(sx, sy, rho)));
    }
}
