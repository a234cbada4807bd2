//! Pairs of two lists: as many as there can be, then at least cost.

use super::report::{Fused, Member, Report, listed};
use crate::association::assignment::{Assigner, Candidate};

/// Cost of a forbidden pair, which the authors of InfraDet3D (999999) and of DAIR-V2X (1e6) give to scipy's
/// `linear_sum_assignment`: so no allowed pair is dropped to make others cheaper.
const FORBIDDEN: f64 = 1e6;

/// The fused list of agents, one after another: each one's reports are paired with the list so far at least
/// cost, `merge` takes a pair's report in, and those without a pair are appended.
pub(super) fn fold(
    agents: &[&[Report]],
    cost: impl Fn(&Fused, &Report) -> Option<f64>,
    merge: impl Fn(&mut Fused, &Report),
) -> Vec<Fused> {
    let mut fused: Vec<Fused> = Vec::new();
    let mut assigner = Assigner::default();
    let mut candidates = Vec::new();
    for (agent, reports) in agents.iter().enumerate() {
        candidates.clear();
        for (row, one) in (0..).zip(&fused) {
            for (col, report) in (0..).zip(*reports) {
                if one.z.class.is_compatible_with(report.z.class)
                    && let Some(cost) = cost(one, report)
                {
                    candidates.push(Candidate { row, col, cost });
                }
            }
        }
        let pairs = assigner.solve(fused.len(), reports.len(), &candidates, FORBIDDEN);
        let mut is_paired = vec![false; reports.len()];
        for (one, found) in fused.iter_mut().zip(pairs) {
            if let Some(index) = found.map(|index| index as usize) {
                is_paired[index] = true;
                merge(one, &reports[index]);
                one.members.push(Member { agent, index });
            }
        }
        let alone = listed(agent, reports).zip(is_paired).filter(|(_, is_paired)| !is_paired);
        fused.extend(alone.map(|((member, report), _)| Fused::of(report, member)));
    }
    fused
}

/// The distance of centres, m, where it is at most `reach_m`.
pub(super) fn distance_within(reach_m: f64, one: &Fused, report: &Report) -> Option<f64> {
    let (a, b) = (one.z.position, report.z.position);
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    let distance_m = libm::sqrt(dx * dx + dy * dy);
    (distance_m <= reach_m).then_some(distance_m)
}

#[cfg(test)]
mod tests {
    use super::super::testing::report;
    use super::*;

    #[test]
    fn more_pairs_come_before_shorter_ones() {
        // At 3 m two pairs of 2 m each are possible, though one of 0 m and two lone boxes would be shorter.
        let (a, b) = ([report(0.0, 0.0), report(2.0, 0.0)], [report(2.0, 0.0), report(4.0, 0.0)]);
        let fused = fold(&[&a, &b], |one, report| distance_within(3.0, one, report), |_, _| {});
        assert_eq!(fused.len(), 2);
        assert!(fused.iter().all(|one| one.members.len() == 2));
    }

    #[test]
    fn a_third_agent_joins_the_list_of_two() {
        let lists = [[report(0.0, 0.0)], [report(1.0, 0.0)], [report(20.0, 0.0)]];
        let agents: Vec<&[Report]> = lists.iter().map(<[Report; 1]>::as_slice).collect();
        let fused = fold(&agents, |one, report| distance_within(3.0, one, report), |_, _| {});
        assert_eq!(fused.len(), 2);
        assert_eq!(fused[1].members, [Member { agent: 2, index: 0 }]);
    }
}
