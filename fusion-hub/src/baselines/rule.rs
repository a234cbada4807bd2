//! The rules behind one name each.

use super::psa::Ties;
use super::report::{Fused, Report, listed};
use super::{csba_wls, dair_v2x, infradet3d, nms, psa, wbf};
use serde::{Deserialize, Serialize};

/// A rule of single-frame late fusion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Rule {
    /// The reports of the agent at this place alone.
    Single(usize),
    /// Non-maximum suppression: overlap (IoU) above this drops the lower score.
    Nms {
        /// Largest overlap that two objects may have.
        overlap: f64,
    },
    /// The same with the generalised overlap (GIoU).
    NmsGiou {
        /// Largest generalised overlap that two objects may have.
        overlap: f64,
    },
    /// Promotion-suppression aggregation.
    Psa(Ties),
    /// Weighted box fusion: overlap (IoU) above this merges.
    Wbf {
        /// Smallest overlap of a report with the object that it joins.
        overlap: f64,
    },
    /// InfraDet3D-Late.
    InfraDet3d(infradet3d::Merge),
    /// DAIR-V2X-Late.
    DairV2x(dair_v2x::Variant),
    /// CSBA association and weighted least squares.
    CsbaWls,
}

impl Rule {
    /// Fuses what the agents report of one instant; the first agent is the one that fuses ("ego", "main").
    pub fn fuse(&self, agents: &[&[Report]]) -> Vec<Fused> {
        match *self {
            Self::Single(place) => single(agents, place),
            Self::Nms { overlap } => nms::fuse(agents, nms::Overlap::Iou, overlap),
            Self::NmsGiou { overlap } => nms::fuse(agents, nms::Overlap::Giou, overlap),
            Self::Psa(ties) => psa::fuse(agents, ties),
            Self::Wbf { overlap } => wbf::fuse(agents, overlap),
            Self::InfraDet3d(merge) => infradet3d::fuse(agents, merge),
            Self::DairV2x(variant) => dair_v2x::fuse(agents, variant),
            Self::CsbaWls => csba_wls::fuse(agents),
        }
    }
}

fn single(agents: &[&[Report]], place: usize) -> Vec<Fused> {
    let reports = agents.get(place).copied().unwrap_or_default();
    listed(place, reports).map(|(member, report)| Fused::of(report, member)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Member;
    use super::super::testing::{self, report};
    use super::*;

    #[test]
    fn one_agent_alone_is_published_as_it_reports() {
        let (first, second) = ([report(0.0, 0.0)], [report(1.0, 0.0), report(9.0, 0.0)]);
        let fused = Rule::Single(1).fuse(&[&first, &second]);
        assert_eq!(fused.len(), 2);
        assert_eq!(fused[1].members, [Member { agent: 1, index: 1 }]);
        assert_eq!(fused[1].bev().x, 9.0);
        assert!(Rule::Single(2).fuse(&[&first, &second]).is_empty());
    }

    #[test]
    fn agents_without_reports_change_no_result() {
        let rules = [
            Rule::Single(0),
            Rule::Nms { overlap: 0.5 },
            Rule::NmsGiou { overlap: 0.5 },
            Rule::Psa(Ties::Kept),
            Rule::Wbf { overlap: 0.5 },
            Rule::InfraDet3d(infradet3d::Merge::FirstBoxMeanSize),
            Rule::DairV2x(dair_v2x::Variant::Average),
            Rule::CsbaWls,
        ];
        for rule in rules {
            assert!(rule.fuse(&[]).is_empty());
            assert!(rule.fuse(&[&[], &[]]).is_empty());
            assert_eq!(rule.fuse(&[&[report(0.0, 0.0)], &[]]).len(), 1, "{rule:?}");
        }
    }

    #[test]
    fn no_rule_merges_different_classes() {
        let cone = testing::of_class(report(0.0, 0.0), v2x_common::class::Class::TrafficCone);
        let rules = [
            Rule::Nms { overlap: 0.5 },
            Rule::NmsGiou { overlap: 0.5 },
            Rule::Wbf { overlap: 0.5 },
            Rule::InfraDet3d(infradet3d::Merge::FirstBoxMeanSize),
            Rule::DairV2x(dair_v2x::Variant::Average),
            Rule::DairV2x(dair_v2x::Variant::MainAgent),
            Rule::CsbaWls,
        ];
        for rule in rules {
            assert_eq!(rule.fuse(&[&[report(0.0, 0.0)], &[cone]]).len(), 2, "{rule:?}");
            assert_eq!(rule.fuse(&[&[report(0.0, 0.0)], &[report(0.0, 0.0)]]).len(), 1, "{rule:?}");
        }
    }
}
