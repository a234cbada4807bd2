//! A world of recorded traffic.

use std::sync::Arc;

use super::body::Shape;
use super::motion::Motion;
use super::road::{Road, RoadKind};
use crate::trajectories::{RecordedObject, Traffic};
use crate::truth::ObjectId;

/// What comes after the last row of a world's traffic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Course {
    /// It begins again.
    Repeats,
    /// Nothing: it is empty then.
    Ends,
    /// More rows: another program drives it, and these are its last seconds.
    Live {
        /// The ids of the traffic's objects, rising.
        numbers: Vec<u32>,
    },
}

/// Traffic as a world: objects of a recording have the ids 1, 2, … in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedWorld {
    /// Who was where.
    pub traffic: Arc<Traffic>,
    /// What comes after its last row.
    pub course: Course,
    /// Lines and areas on the ground, for pictures.
    pub roads: Vec<Road>,
}

/// The areas that a recording has, for pictures.
pub fn traffic_roads(traffic: &Traffic) -> Vec<Road> {
    let area = |points: &Vec<_>| Road { kind: RoadKind::Area, width_m: 0.0, points: points.clone() };
    traffic.areas.iter().map(area).collect()
}

impl RecordedWorld {
    /// The id of an object in the world, by its id in the file.
    pub fn object_id(&self, name: &str) -> Option<ObjectId> {
        self.id_at(self.traffic.object_index(name)?)
    }

    /// Whether another program drives it.
    pub const fn is_live(&self) -> bool {
        matches!(self.course, Course::Live { .. })
    }

    fn id_at(&self, index: usize) -> Option<ObjectId> {
        match &self.course {
            Course::Live { numbers } => numbers.get(index).copied().map(ObjectId),
            Course::Repeats | Course::Ends => u32::try_from(index).ok().map(|index| ObjectId(index + 1)),
        }
    }

    pub(super) fn population(&self) -> Vec<(ObjectId, Shape, Motion)> {
        let objects = self.traffic.objects.iter().enumerate();
        objects.filter_map(|(index, object)| Some(shape_and_motion(self.id_at(index)?, object))).collect()
    }

    /// The object of this name in the file.
    pub(super) fn named(&self, name: &str) -> Option<(ObjectId, Shape, Motion)> {
        let index = self.traffic.object_index(name)?;
        Some(shape_and_motion(self.id_at(index)?, self.traffic.objects.get(index)?))
    }
}

fn shape_and_motion(id: ObjectId, object: &RecordedObject) -> (ObjectId, Shape, Motion) {
    let RecordedObject { class, w, d, trajectory, .. } = object;
    (id, Shape { class: *class, w: *w, d: *d }, Motion::Recorded(Arc::clone(trajectory)))
}
