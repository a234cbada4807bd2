//! The true objects that count, by time. All methods of a point publish at the same times and share them.

use crate::data::scene::TrueBox;
use crate::score::coverage::Coverage;
use crate::score::sweep::record::Subset;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::geometry::Pose;
use v2x_common::time::{Span, Timestamp};

/// Objects that stay within this distance of their first position are static, m.
const STATIC_M: f64 = 1.0;
/// Faster ones are fast, m/s.
const FAST_MPS: f64 = 3.0;
/// Step of the search for objects that move.
const LIFE_STEP: Span = Span::from_millis(500);

/// The world at one time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Snapshot {
    /// All objects, by id.
    pub objects: Vec<TrueBox>,
    /// Whether each counts: covered by the first two agents.
    pub counts: Vec<bool>,
    /// The subsets of each.
    pub subsets: Vec<[bool; 4]>,
    poses: Vec<Option<Pose>>,
}

/// Snapshots, each computed once.
#[derive(Debug)]
pub(crate) struct Snapshots<'a> {
    coverage: Coverage<'a>,
    bodies: BTreeSet<ObjectId>,
    movers: BTreeSet<ObjectId>,
    snapshots: BTreeMap<Timestamp, Rc<Snapshot>>,
}

impl<'a> Snapshots<'a> {
    /// The snapshots of a run between two times. Agents' own `bodies` never count.
    pub(crate) fn new(
        mut coverage: Coverage<'a>,
        bodies: BTreeSet<ObjectId>,
        start: Timestamp,
        end: Timestamp,
    ) -> Self {
        let mut first: BTreeMap<ObjectId, Pose> = BTreeMap::new();
        let mut movers = BTreeSet::new();
        let mut at = start;
        while at <= end {
            for object in coverage.at(at).objects {
                let pose = object.bev.pose();
                let began = first.entry(object.id).or_insert(pose);
                if began.distance_to(pose.x, pose.y) > STATIC_M {
                    movers.insert(object.id);
                }
            }
            at += LIFE_STEP;
        }
        Self { coverage, bodies, movers, snapshots: BTreeMap::new() }
    }

    /// The world at a time.
    pub(crate) fn at(&mut self, at: Timestamp) -> Rc<Snapshot> {
        if let Some(snapshot) = self.snapshots.get(&at) {
            return snapshot.clone();
        }
        let view = self.coverage.at(at);
        let counts = |id| self.coverage.is_common(&view, id) && !self.bodies.contains(&id);
        let counts = view.objects.iter().map(|object| counts(object.id)).collect();
        let subsets = view.objects.iter().map(|object| self.subsets(object)).collect();
        let objects = view.objects.iter().map(TrueBox::from).collect();
        let snapshot = Rc::new(Snapshot { counts, subsets, objects, poses: view.poses });
        self.snapshots.insert(at, snapshot.clone());
        snapshot
    }

    fn subsets(&self, object: &TrueObject) -> [bool; 4] {
        let moves = self.movers.contains(&object.id);
        let (vx, vy) = object.velocity;
        Subset::ALL.map(|subset| match subset {
            Subset::All => true,
            Subset::Static => !moves,
            Subset::Moving => moves,
            Subset::Fast => libm::hypot(vx, vy) > FAST_MPS,
        })
    }

    /// Whether both agents cover the point (m) at this time.
    pub(crate) fn is_in_view(&self, snapshot: &Snapshot, x: f64, y: f64) -> bool {
        self.coverage
            .observers()
            .iter()
            .zip(&snapshot.poses)
            .all(|(observer, pose)| pose.is_some_and(|pose| observer.field_of_view.contains(&pose, x, y)))
    }
}
