//! The provenance of detections: agent, time of capture and true object.

use std::collections::BTreeMap;
use v2x_agent::truth::ObjectId;
use v2x_common::fused::FusedObject;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::time::Timestamp;

/// The provenance of all detections of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Provenance {
    agents: BTreeMap<AgentId, BTreeMap<(u64, u64), SideTable>>,
}

/// The simulation truth of one frame.
#[derive(Clone, Debug)]
struct SideTable {
    captured_at: Timestamp,
    objects: Vec<Option<ObjectId>>,
}

/// A detection in a fused object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contribution {
    /// Its agent.
    pub agent: AgentId,
    /// When it was captured, in true time.
    pub captured_at: Timestamp,
    /// The true object; `None` for clutter.
    pub object: Option<ObjectId>,
}

impl Provenance {
    /// Adds the side table of a frame.
    pub(crate) fn insert(&mut self, frame: FrameId, captured_at: Timestamp, objects: Vec<Option<ObjectId>>) {
        let FrameId { agent, epoch, sequence } = frame;
        self.agents.entry(agent).or_default().insert((epoch, sequence), SideTable { captured_at, objects });
    }

    /// The detections in a fused object, as far as they are known.
    pub(crate) fn of<'a>(&'a self, object: &'a FusedObject) -> impl Iterator<Item = Contribution> + 'a {
        object.contributors.iter().filter_map(|used| {
            let FrameId { agent, epoch, sequence } = used.frame;
            let frame = self.agents.get(&agent)?.get(&(epoch, sequence))?;
            let object = frame.objects.get(usize::from(used.index)).copied().flatten();
            Some(Contribution { agent, captured_at: frame.captured_at, object })
        })
    }

    /// The true object that a fused object is scored against: that of the first agent's last detection in it, else of
    /// the newest detection.
    pub(crate) fn object(&self, fused: &FusedObject, first: AgentId) -> Option<ObjectId> {
        let by_first = self.of(fused).find(|contribution| contribution.agent == first);
        let newest = || self.of(fused).max_by_key(|contribution| contribution.captured_at);
        by_first.or_else(newest).and_then(|contribution| contribution.object)
    }
}
