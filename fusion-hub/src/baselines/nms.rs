//! Non-maximum suppression (deploy/docs/methods.md): OpenCOOD's `nms_rotated`, with IoU or GIoU.

use super::report::{Fused, Report, bev, pooled};
use crate::values::overlap::Footprint;

/// How overlap is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlap {
    /// Intersection over union of the rotated boxes.
    Iou,
    /// Its generalised form (Rezatofighi 2019), which is never larger.
    Giou,
}

impl Overlap {
    /// GIoU is never above IoU, and its hull takes time.
    fn exceeds(self, threshold: f64, a: &Footprint, b: &Footprint) -> bool {
        a.iou(b) > threshold && (self == Self::Iou || a.giou(b) > threshold)
    }
}

/// Keeps reports from the highest score down; each drops all others that overlap it by more than `threshold`,
/// those of its own agent among them.
pub fn fuse(agents: &[&[Report]], overlap: Overlap, threshold: f64) -> Vec<Fused> {
    let mut kept: Vec<(Footprint, Fused)> = Vec::new();
    for (member, report) in pooled(agents) {
        let outline = Footprint::of(&bev(&report.z));
        let is_dropped = kept.iter().any(|(other, fused)| {
            fused.z.class.is_compatible_with(report.z.class) && overlap.exceeds(threshold, other, &outline)
        });
        if !is_dropped {
            kept.push((outline, Fused::of(report, member)));
        }
    }
    kept.into_iter().map(|(_, fused)| fused).collect()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{report, scored, sized};
    use super::super::{Member, Rule};

    #[test]
    fn the_first_agents_box_stays_where_scores_are_equal() {
        // 1 m along a 4 m box: IoU 3 / 5.
        let fused = Rule::Nms { overlap: 0.5 }.fuse(&[&[report(0.0, 0.0)], &[report(1.0, 0.0)]]);
        assert_eq!(fused.len(), 1);
        assert_eq!(fused[0].members, [Member { agent: 0, index: 0 }]);
        assert_eq!(fused[0].bev().x, 0.0);
    }

    #[test]
    fn the_higher_score_stays() {
        let fused = Rule::Nms { overlap: 0.5 }.fuse(&[&[scored(report(0.0, 0.0), 0.4)], &[report(1.0, 0.0)]]);
        assert_eq!(fused[0].members, [Member { agent: 1, index: 0 }]);
    }

    #[test]
    fn overlap_at_the_threshold_is_kept() {
        let (a, b) = ([report(0.0, 0.0)], [report(1.0, 0.0)]);
        assert_eq!(Rule::Nms { overlap: 0.6 + 1e-12 }.fuse(&[&a, &b]).len(), 2);
        assert_eq!(Rule::Nms { overlap: 0.6 - 1e-12 }.fuse(&[&a, &b]).len(), 1);
    }

    #[test]
    fn giou_drops_less() {
        // A 2 m × 4 m box, and the same turned by a right angle: intersection 4, union 12, hull 14.
        let (a, b) = ([report(0.0, 0.0)], [sized(report(0.0, 0.0), [2.0, 4.0], std::f64::consts::FRAC_PI_2)]);
        let giou = 4.0 / 12.0 - 2.0 / 14.0;
        assert_eq!(Rule::Nms { overlap: 0.3 }.fuse(&[&a, &b]).len(), 1);
        assert_eq!(Rule::NmsGiou { overlap: 0.3 }.fuse(&[&a, &b]).len(), 2);
        assert_eq!(Rule::NmsGiou { overlap: giou - 1e-9 }.fuse(&[&a, &b]).len(), 1);
        assert_eq!(Rule::NmsGiou { overlap: giou + 1e-9 }.fuse(&[&a, &b]).len(), 2);
    }

    #[test]
    fn a_dropped_box_suppresses_no_other() {
        // Chain: 0 drops 1 (IoU 3/5), 1 would drop 2.
        let chain = [report(0.0, 0.0), report(1.0, 0.0), report(2.0, 0.0)];
        let fused = Rule::Nms { overlap: 0.5 }.fuse(&[&chain]);
        let kept: Vec<f64> = fused.iter().map(|fused| fused.bev().x).collect();
        assert_eq!(kept, [0.0, 2.0]);
    }
}
