//! ASE, the error of size alone: 1 − IoU of two aligned boxes.
//!
//! nuScenes' scale error (`eval/common/utils.py`, `scale_iou`) with bird's-eye boxes' width and depth instead of
//! its three sizes: equal heights cancel. A mean over all correspondences; scenes are combined by adding moments.

use crate::score::moments::Moments;
use crate::score::tracking::correspondence::correspond;
use crate::score::tracking::indexed::Indexed;
use crate::score::tracking::sequence::Sequence;
use v2x_common::geometry::BevBox;

/// 1 − IoU of the boxes with their centres and headings made equal, in [0, 1]; 1 where both have no area.
pub fn scale_error(reported: &BevBox, truth: &BevBox) -> f64 {
    let intersection = reported.w.min(truth.w) * reported.d.min(truth.d);
    let union = reported.w * reported.d + truth.w * truth.d - intersection;
    if union > 0.0 { 1.0 - intersection / union } else { 1.0 }
}

/// The scale errors of CLEAR MOT's correspondences of a scene within `gate_m`.
pub fn scale_errors(sequence: &Sequence, gate_m: f64) -> Moments {
    let mut errors = Moments::default();
    correspond(&Indexed::of(sequence, gate_m), gate_m, f64::NEG_INFINITY, |pair| {
        let instant = &sequence.instants()[pair.instant];
        errors.add(Some(scale_error(&instant.reported[pair.reported].bev, &instant.truth[pair.object].bev)));
    });
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::sequence::{GATE_M, Instant};
    use crate::score::tracking::testing::{at, instant, sequence};

    #[test]
    fn the_scale_error_ignores_position_and_heading() {
        let turned = BevBox { x: 9.0, yaw: 2.0, ..at(0.0) };
        assert_eq!(scale_error(&turned, &at(0.0)), 0.0);
        assert_eq!(scale_error(&BevBox { d: 3.0, ..at(0.0) }, &at(0.0)), 0.25);
        assert_eq!(scale_error(&at(0.0), &BevBox { d: 3.0, ..at(0.0) }), 0.25);
    }

    #[test]
    fn boxes_without_area_have_no_overlap() {
        let line = BevBox { w: 0.0, ..at(0.0) };
        assert_eq!((scale_error(&line, &line), scale_error(&line, &at(0.0))), (1.0, 1.0));
    }

    #[test]
    fn only_matched_boxes_count() {
        let mut short = instant(&[(0, 0.0), (1, 9.0)], &[(7, 0.1), (8, 30.0)]);
        short.reported[0].bev.d = 3.0;
        let scene = Sequence::new(vec![Instant::default(), short]).unwrap();
        let errors = scale_errors(&scene, GATE_M);
        assert_eq!((errors.n(), errors.mean()), (1, Some(0.25)));
        assert_eq!(scale_errors(&sequence(&[]), GATE_M).mean(), None);
    }
}
