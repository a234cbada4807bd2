//! Weighted box fusion (Solovyev 2021; deploy/docs/methods.md): `ensemble_boxes_wbf.py`, over rotated boxes.

use super::mean::mean;
use super::report::{Fused, Report, bev, pooled};
use crate::values::overlap::Footprint;

/// A cluster of reports.
struct Cluster<'a> {
    outline: Footprint,
    fused: Fused,
    reports: Vec<&'a Report>,
}

impl<'a> Cluster<'a> {
    fn join(&mut self, report: &'a Report) {
        self.reports.push(report);
        let weighted: Vec<_> = self.reports.iter().map(|report| (&report.z, report.score)).collect();
        self.fused.z = mean(&weighted);
        self.outline = Footprint::of(&self.fused.bev());
    }
}

/// From the highest score down, each report joins the box so far that it overlaps most, if by more than
/// `threshold`; that one becomes the mean of its reports, weighted by score. A box's score is the mean of its
/// reports' scores, times the share of agents that it has reports for.
pub fn fuse(agents: &[&[Report]], threshold: f64) -> Vec<Fused> {
    let mut clusters: Vec<Cluster<'_>> = Vec::new();
    for (member, report) in pooled(agents) {
        let outline = Footprint::of(&bev(&report.z));
        let mut best = (threshold, None);
        for (place, cluster) in clusters.iter().enumerate() {
            if cluster.fused.z.class.is_compatible_with(report.z.class) {
                let overlap = cluster.outline.iou(&outline);
                if overlap > best.0 {
                    best = (overlap, Some(place));
                }
            }
        }
        if let Some(place) = best.1 {
            clusters[place].fused.members.push(member);
            clusters[place].join(report);
        } else {
            clusters.push(Cluster { outline, fused: Fused::of(report, member), reports: vec![report] });
        }
    }
    clusters.into_iter().map(|cluster| scored(cluster, agents.len())).collect()
}

#[expect(clippy::cast_precision_loss, reason = "numbers of boxes")]
fn scored(cluster: Cluster<'_>, n_agents: usize) -> Fused {
    let n = cluster.reports.len();
    let mean = cluster.reports.iter().map(|report| report.score).sum::<f64>() / n as f64;
    let mut fused = cluster.fused;
    // In the order of agents, as all rules name members.
    fused.members.sort_unstable();
    Fused { score: mean * n.min(n_agents) as f64 / n_agents as f64, ..fused }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{close, report, scored};
    use super::super::{Member, Rule};

    #[test]
    fn boxes_are_averaged_by_score() {
        // IoU at 1 m: 3 / 5.
        let (a, b) = ([scored(report(0.0, 0.0), 0.9)], [scored(report(1.0, 0.0), 0.3), report(20.0, 0.0)]);
        let fused = Rule::Wbf { overlap: 0.5 }.fuse(&[&a, &b]);
        assert_eq!(fused.len(), 2);
        // The report of score 1 comes first, and has one agent of two.
        assert!(close(fused[0].score, 0.5));
        assert!(close(fused[1].bev().x, 0.25), "0.3 of 1.2 parts");
        assert!(close(fused[1].score, 0.6));
        assert_eq!(fused[1].members, [Member { agent: 0, index: 0 }, Member { agent: 1, index: 0 }]);
    }

    #[test]
    fn reports_are_compared_with_the_current_mean_box() {
        // 0 and 1 give 0.5; 1.5 overlaps that by 3/5, the first one by 2.5/5.5.
        let chain =
            [scored(report(0.0, 0.0), 0.9), scored(report(1.0, 0.0), 0.9), scored(report(1.5, 0.0), 0.8)];
        let fused = Rule::Wbf { overlap: 0.55 }.fuse(&[&chain]);
        assert_eq!(fused.len(), 1);
    }
}
