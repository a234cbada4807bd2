//! Promotion-suppression aggregation (Xu 2023; deploy/docs/methods.md): model_anostic's `aggregation`.

use super::report::{Fused, Member, Report, bev, listed};
use crate::values::overlap::Footprint;
use serde::{Deserialize, Serialize};

/// Boxes whose centres are this far apart are not compared, m.
const REACH_M: f64 = 10.0;
/// Temperature of the softmax by which a cluster decides.
const TEMPERATURE: f64 = 1e-6;

/// What becomes of several boxes with the highest value in their cluster.
///
/// With equal scores every cluster of two is such a tie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ties {
    /// All are kept: the only reading that gives the paper's constant precision of 50 %.
    Kept,
    /// None is kept, as the published code does: no share of the softmax is above one half.
    Dropped,
}

/// In each cluster of overlapping boxes keeps the one that the others support most: the highest sum of
/// overlap × score.
///
/// A cluster is what overlaps the first box that is in none yet, however little; it may hold boxes of earlier
/// clusters. A box that several clusters keep is listed once.
pub fn fuse(agents: &[&[Report]], ties: Ties) -> Vec<Fused> {
    let boxes: Vec<(Member, &Report)> =
        agents.iter().enumerate().flat_map(|(agent, reports)| listed(agent, reports)).collect();
    let outlines: Vec<Footprint> = boxes.iter().map(|(_, report)| Footprint::of(&bev(&report.z))).collect();
    let overlap = |i: usize, j: usize| {
        if i == j {
            return 1.0;
        }
        // One order of the pair, so that ties are exact.
        let (a, b) = (i.min(j), i.max(j));
        let (one, other) = (&boxes[a].1.z, &boxes[b].1.z);
        let (dx, dy) = (one.position[0] - other.position[0], one.position[1] - other.position[1]);
        let is_near = dx * dx + dy * dy < REACH_M * REACH_M;
        if is_near && one.class.is_compatible_with(other.class) { outlines[a].iou(&outlines[b]) } else { 0.0 }
    };
    let (mut is_visited, mut is_kept) = (vec![false; boxes.len()], vec![false; boxes.len()]);
    for first in 0..boxes.len() {
        if is_visited[first] {
            continue;
        }
        let cluster: Vec<usize> = (0..boxes.len()).filter(|other| overlap(first, *other) > 0.0).collect();
        let value = |i: usize| cluster.iter().map(|j| overlap(i, *j) * boxes[*j].1.score).sum::<f64>();
        let values: Vec<f64> = cluster.iter().map(|i| value(*i)).collect();
        let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let n_highest = values.iter().filter(|value| highest - **value < TEMPERATURE).count();
        for (place, value) in cluster.iter().zip(&values) {
            is_visited[*place] = true;
            is_kept[*place] |= highest - value < TEMPERATURE && (n_highest == 1 || ties == Ties::Kept);
        }
    }
    let kept = boxes.iter().zip(&is_kept).filter(|(_, is_kept)| **is_kept);
    kept.map(|((member, report), _)| Fused::of(report, *member)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Rule;
    use super::super::testing::{report, scored};
    use super::*;

    fn kept(rule: Ties, agents: &[&[Report]]) -> Vec<f64> {
        Rule::Psa(rule).fuse(agents).iter().map(|fused| fused.bev().x).collect()
    }

    #[test]
    fn two_boxes_of_equal_score_are_a_tie() {
        let (a, b) = ([report(0.0, 0.0)], [report(1.0, 0.0)]);
        assert_eq!(kept(Ties::Kept, &[&a, &b]), [0.0, 1.0]);
        assert!(kept(Ties::Dropped, &[&a, &b]).is_empty());
    }

    #[test]
    fn the_box_that_others_support_most_is_kept() {
        // Values at offsets 0, 1, 2 m: 1 + 3/5 + 2/6, 1 + 2 · 3/5, 1 + 3/5 + 2/6.
        let (a, b) = ([report(0.0, 0.0), report(2.0, 0.0)], [report(1.0, 0.0)]);
        assert_eq!(kept(Ties::Dropped, &[&a, &b]), [1.0]);
    }

    #[test]
    fn the_score_of_another_box_promotes() {
        // Values: 0.9 + 0.6 · 0.5 = 1.2 and 0.5 + 0.6 · 0.9 = 1.04.
        let (a, b) = ([scored(report(0.0, 0.0), 0.9)], [scored(report(1.0, 0.0), 0.5)]);
        assert_eq!(kept(Ties::Dropped, &[&a, &b]), [0.0]);
    }

    #[test]
    fn boxes_that_touch_nothing_are_kept() {
        assert_eq!(kept(Ties::Dropped, &[&[report(0.0, 0.0)], &[report(5.0, 0.0)]]), [0.0, 5.0]);
    }
}
