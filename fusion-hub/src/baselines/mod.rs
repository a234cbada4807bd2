//! Late fusion of a single instant, the published rules: the reports of several agents at one time become one list,
//! without memory and without motion. The rules of the paper's comparison (Table II; METHODS.md 1-8).
//!
//! All rules are class-aware: reports of incompatible classes are never of one object (METHODS.md 0). Where a
//! rule takes two lists, further agents are fused one after another into the list so far.

pub mod csba_wls;
pub mod dair_v2x;
pub mod infradet3d;
mod mean;
pub mod nms;
mod pairing;
pub mod psa;
#[cfg(test)]
mod testing;
pub mod wbf;

use crate::values::Measurement;
use v2x_common::covariance::BoxCovariance;
use v2x_common::geometry::BevBox;

pub use psa::Ties;

/// One report of an agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// What was measured.
    pub z: Measurement,
    /// The detector's confidence, 0 to 1.
    pub score: f64,
}

/// Which report of which agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Member {
    /// Place of the agent.
    pub agent: usize,
    /// Place of the report in the agent's list.
    pub index: usize,
}

/// One object of the fused list.
#[derive(Clone, Debug, PartialEq)]
pub struct Fused {
    /// Its estimate, as one more accurate measurement.
    pub z: Measurement,
    /// Its confidence, 0 to 1.
    pub score: f64,
    /// The reports that it was made of; suppressed ones are not among them.
    pub members: Vec<Member>,
}

impl Fused {
    fn of(report: &Report, member: Member) -> Self {
        Self { z: report.z, score: report.score, members: vec![member] }
    }

    /// The box.
    pub fn bev(&self) -> BevBox {
        bev(&self.z)
    }

    /// The covariance of the fused box, where it follows from the reports' covariances.
    pub fn covariance(&self) -> BoxCovariance {
        let of_size = |axis: usize| self.z.relative_variance[axis] * self.z.size[axis] * self.z.size[axis];
        BoxCovariance { position: self.z.r, ww: of_size(0), dd: of_size(1), yaw: self.z.yaw_variance }
    }
}

/// A rule of single-frame late fusion.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// The reports of one agent with their places.
fn listed(agent: usize, reports: &[Report]) -> impl Iterator<Item = (Member, &Report)> {
    reports.iter().enumerate().map(move |(index, report)| (Member { agent, index }, report))
}

/// All reports, highest score first; of equal ones the earlier agent's first (METHODS.md 1).
fn pooled<'a>(agents: &[&'a [Report]]) -> Vec<(Member, &'a Report)> {
    let mut pool: Vec<_> =
        agents.iter().enumerate().flat_map(|(agent, reports)| listed(agent, reports)).collect();
    pool.sort_by(|a, b| b.1.score.total_cmp(&a.1.score));
    pool
}

fn bev(z: &Measurement) -> BevBox {
    let ([x, y], [w, d]) = (z.position, z.size);
    BevBox { x, y, w, d, yaw: z.yaw }
}

#[cfg(test)]
mod tests {
    use super::testing::report;
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
