//! The ground truth as the score needs it: two questions about the world at a time.

use std::fmt;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::geometry::Pose;
use v2x_common::id::AgentId;
use v2x_common::sensor::FieldOfView;
use v2x_common::time::Timestamp;

/// The world, asked by time: a pure function, so that asking twice gives the same answer.
#[derive(Clone, Copy)]
pub(crate) struct Truth<'a> {
    /// Fills an empty list with all objects of the world at a time, in the map frame.
    pub objects_at: &'a dyn Fn(Timestamp, &mut Vec<TrueObject>),
    /// Where an agent's sensor truly is at a time; `None` where there is no such agent.
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

/// Who looks at the world, and where it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Observer {
    /// Which agent.
    pub agent: AgentId,
    /// Where it sees, relative to its pose.
    pub field_of_view: FieldOfView,
    /// Which object of the world it is itself, where it is one (a vehicle).
    pub itself: Option<ObjectId>,
}
