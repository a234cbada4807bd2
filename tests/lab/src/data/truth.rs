//! The ground truth of a run: true objects and sensor poses by time.

use std::fmt;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::sensor::FieldOfView;
use v2x_common::time::Timestamp;

/// The world by time: a pure function.
#[derive(Clone, Copy)]
pub(crate) struct Truth<'a> {
    /// Fills an empty list with all objects at a time, in the map frame.
    pub objects_at: &'a dyn Fn(Timestamp, &mut Vec<TrueObject>),
    /// True pose of an agent's sensor at a time; `None` where there is no such agent.
    pub agent_pose: &'a dyn Fn(&AgentId, Timestamp) -> Option<Pose>,
}

impl Truth<'_> {
    /// All objects at a time, by id.
    pub(crate) fn objects(&self, at: Timestamp) -> Vec<TrueObject> {
        let mut objects = Vec::new();
        (self.objects_at)(at, &mut objects);
        objects.sort_unstable_by_key(|object| object.id);
        objects
    }
}

impl fmt::Debug for Truth<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Truth").finish_non_exhaustive()
    }
}

/// An agent with its field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Observer {
    /// Which agent.
    pub agent: AgentId,
    /// Field of view, relative to its pose.
    pub field_of_view: FieldOfView,
    /// The object of the world that is this agent (a vehicle).
    pub itself: Option<ObjectId>,
}
