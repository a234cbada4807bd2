//! A world of recorded traffic.

use std::sync::Arc;

use super::body::Shape;
use super::motion::Motion;
use super::road::Road;
use crate::trajectories::{RecordedObject, Traffic};
use crate::truth::ObjectId;

/// Recorded traffic as a world: its objects have the ids 1, 2, … in the recording's order.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedWorld {
    /// Who was where.
    pub traffic: Arc<Traffic>,
    /// Whether it begins again after its end; otherwise it is empty then.
    pub repeats: bool,
    /// Lines and areas on the ground, for pictures.
    pub roads: Vec<Road>,
}

impl RecordedWorld {
    /// The id of an object in the world, by its id in the file.
    pub fn object_id(&self, name: &str) -> Option<ObjectId> {
        let index = self.traffic.object_index(name)?;
        u32::try_from(index).ok().map(|index| ObjectId(index + 1))
    }

    pub(super) fn population(&self) -> Vec<(Shape, Motion)> {
        self.traffic.objects.iter().map(shape_and_motion).collect()
    }

    pub(super) fn object(&self, id: ObjectId) -> Option<(Shape, Motion)> {
        let index = id.0.checked_sub(1)? as usize;
        self.traffic.objects.get(index).map(shape_and_motion)
    }
}

fn shape_and_motion(object: &RecordedObject) -> (Shape, Motion) {
    let RecordedObject { class, w, d, trajectory, .. } = object;
    (Shape { class: *class, w: *w, d: *d }, Motion::Recorded(Arc::clone(trajectory)))
}
