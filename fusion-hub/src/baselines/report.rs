//! Reports of agents, and the objects that they are fused to.

use crate::values::Measurement;
use serde::{Deserialize, Serialize};
use v2x_common::covariance::BoxCovariance;
use v2x_common::geometry::BevBox;

/// One report of an agent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    pub(super) fn of(report: &Report, member: Member) -> Self {
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

/// The reports of one agent with their places.
pub(super) fn listed(agent: usize, reports: &[Report]) -> impl Iterator<Item = (Member, &Report)> {
    reports.iter().enumerate().map(move |(index, report)| (Member { agent, index }, report))
}

/// All reports, highest score first; of equal ones the earlier agent's first (deploy/docs/methods.md).
pub(super) fn pooled<'a>(agents: &[&'a [Report]]) -> Vec<(Member, &'a Report)> {
    let mut pool: Vec<_> =
        agents.iter().enumerate().flat_map(|(agent, reports)| listed(agent, reports)).collect();
    pool.sort_by(|a, b| b.1.score.total_cmp(&a.1.score));
    pool
}

/// The box of a measurement.
pub(super) fn bev(z: &Measurement) -> BevBox {
    let ([x, y], [w, d]) = (z.position, z.size);
    BevBox { x, y, w, d, yaw: z.yaw }
}
