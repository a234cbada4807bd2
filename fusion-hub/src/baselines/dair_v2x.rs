//! DAIR-V2X-Late (Yu 2022; deploy/docs/methods.md): `late_fusion_utils.py`, in the plane.

use super::mean::mean;
use super::pairing::{distance_within, fold};
use super::report::{Fused, Report};
use serde::{Deserialize, Serialize};

/// Largest distance of centres in a pair, m (paper, Table I; the code has none).
const REACH_M: f64 = 3.0;
/// What becomes of the score of another agent's box that has no pair.
const LONE_SCORE: f64 = 0.4;

/// The variant of the rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Variant {
    /// Pairs within 3 m, plain average: as the paper's rows indicate.
    Average,
    /// The authors' code: pairs no further apart, along each axis of the map, than the other agent's box is
    /// large; the first agent's box is kept unchanged.
    MainAgent,
}

/// Pairs by centre distance, at least total distance.
pub fn fuse(agents: &[&[Report]], variant: Variant) -> Vec<Fused> {
    match variant {
        Variant::Average => fold(agents, |one, report| distance_within(REACH_M, one, report), average),
        Variant::MainAgent => {
            let mut fused = fold(agents, main_agents_cost, |_, _| {});
            for one in &mut fused {
                if one.members.iter().all(|member| member.agent > 0) {
                    one.score *= LONE_SCORE;
                }
            }
            fused
        }
    }
}

fn average(one: &mut Fused, report: &Report) {
    #[expect(clippy::cast_precision_loss, reason = "numbers of agents")]
    let n = one.members.len() as f64;
    one.z = mean(&[(&one.z, n), (&report.z, 1.0)]);
    one.score = (n * one.score + report.score) / (n + 1.0);
}

/// `EuclidianMatcher` with `diff_label_filt`: the depth is compared with x, the width with y, whatever the
/// box's heading.
fn main_agents_cost(one: &Fused, report: &Report) -> Option<f64> {
    let ([w, d], a, b) = (report.z.size, one.z.position, report.z.position);
    let is_near = (a[0] - b[0]).abs() <= d && (a[1] - b[1]).abs() <= w;
    is_near.then(|| distance_within(f64::INFINITY, one, report)).flatten()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{report, sized};
    use super::super::{Member, Rule};
    use super::*;

    #[test]
    fn the_papers_row_averages() {
        let (a, b) = ([report(0.0, 0.0)], [sized(report(2.0, 1.0), [1.0, 6.0], 0.2)]);
        let fused = Rule::DairV2x(Variant::Average).fuse(&[&a, &b]);
        assert_eq!(fused.len(), 1);
        let z = fused[0].z;
        assert_eq!((z.position, z.size), ([1.0, 0.5], [1.5, 5.0]));
        assert!((z.yaw - 0.1).abs() < 1e-12);
        let far = [report(2.2, 2.2)];
        assert_eq!(Rule::DairV2x(Variant::Average).fuse(&[&a, &far]).len(), 2, "3.1 m");
    }

    #[test]
    fn the_authors_code_keeps_the_main_agents_box() {
        let rule = Rule::DairV2x(Variant::MainAgent);
        let (a, b) = ([report(0.0, 0.0)], [report(3.9, 1.9), report(9.0, 0.0)]);
        let fused = rule.fuse(&[&a, &b]);
        assert_eq!(fused.len(), 2);
        assert_eq!((fused[0].z, fused[0].score), (a[0].z, 1.0));
        assert_eq!(fused[0].members, [Member { agent: 0, index: 0 }, Member { agent: 1, index: 0 }]);
        assert_eq!(fused[1].score, LONE_SCORE);
        assert_eq!(rule.fuse(&[&a, &[report(0.0, 2.1)]]).len(), 2, "further than the box is wide");
    }
}
