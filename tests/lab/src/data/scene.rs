//! The ground truth of the tables: scenes of keyframes with true boxes.

use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::time::Span;

/// An object is moving if it gets further than this from its first position, m (deploy/docs/methods.md).
const MOVED_M: f64 = 1.0;

/// Number of scenes of a short evaluation.
pub(crate) const QUICK_SCENES: usize = 12;

/// One true object at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueBox {
    /// Its number, below [`Scene::n_objects`].
    pub id: ObjectId,
    /// Its class.
    pub class: Class,
    /// Position and size (m), heading (rad).
    pub bev: BevBox,
}

impl From<&TrueObject> for TrueBox {
    fn from(object: &TrueObject) -> Self {
        Self { id: object.id, class: object.class, bev: object.bev }
    }
}

/// One instant of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyframe {
    /// Since the scene's start.
    pub at: Span,
    /// Pose of agent 1.
    pub ego: Pose,
    /// The true objects.
    pub objects: Vec<TrueBox>,
}

/// A recorded or synthetic scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name in its data set; the noise is keyed by it.
    pub name: String,
    /// In order of time.
    pub keyframes: Vec<Keyframe>,
    is_moving: Vec<bool>,
}

/// Numbers of a data set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Scenes.
    pub scenes: u64,
    /// Keyframes.
    pub keyframes: u64,
    /// Objects.
    pub objects: u64,
    /// Boxes: objects counted once for each keyframe.
    pub boxes: u64,
    /// Boxes of moving objects.
    pub moving_boxes: u64,
    /// Sum of the boxes' distances from agent 1, m.
    pub range_sum_m: f64,
}

impl Scene {
    /// A scene of these keyframes, whose objects are numbered from 0.
    pub fn new(name: String, keyframes: Vec<Keyframe>) -> Self {
        let boxes = || keyframes.iter().flat_map(|keyframe| &keyframe.objects);
        let n_objects = boxes().map(|one| one.id.0 as usize + 1).max().unwrap_or(0);
        let mut first: Vec<Option<BevBox>> = vec![None; n_objects];
        let mut is_moving = vec![false; n_objects];
        for TrueBox { id, bev, .. } in boxes() {
            let id = id.0 as usize;
            let first = first[id].get_or_insert(*bev);
            is_moving[id] |= first.pose().distance_to(bev.x, bev.y) > MOVED_M;
        }
        Self { name, keyframes, is_moving }
    }

    /// Number of objects.
    pub fn n_objects(&self) -> usize {
        self.is_moving.len()
    }

    /// Whether an object moves more than 1 m in the scene.
    pub fn is_moving(&self, id: ObjectId) -> bool {
        self.is_moving[id.0 as usize]
    }

    /// Adds the scene to the statistics.
    pub fn add_to(&self, statistics: &mut Statistics) {
        statistics.scenes += 1;
        statistics.keyframes += self.keyframes.len() as u64;
        statistics.objects += self.n_objects() as u64;
        for keyframe in &self.keyframes {
            for TrueBox { id, bev, .. } in &keyframe.objects {
                statistics.boxes += 1;
                statistics.moving_boxes += u64::from(self.is_moving(*id));
                statistics.range_sum_m += keyframe.ego.distance_to(bev.x, bev.y);
            }
        }
    }
}

impl Statistics {
    /// Of these scenes.
    pub fn of(scenes: &[Scene]) -> Self {
        let mut statistics = Self::default();
        scenes.iter().for_each(|scene| scene.add_to(&mut statistics));
        statistics
    }

    /// The statistics as one line of text.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    pub fn text(&self) -> String {
        let Self { scenes, keyframes, objects, boxes, moving_boxes, range_sum_m } = self;
        let per = |value: f64, of: u64| if of == 0 { 0.0 } else { value / of as f64 };
        format!(
            "{scenes} scenes, {keyframes} keyframes, {objects} objects, {boxes} boxes ({:.1} a frame); {:.1} % of \
             boxes are of objects that move more than 1 m; mean range {:.1} m",
            per(*boxes as f64, *keyframes),
            100.0 * per(*moving_boxes as f64, *boxes),
            per(*range_sum_m, *boxes),
        )
    }
}

/// At most `count` scenes, spread over the whole data set.
pub(crate) fn spread(scenes: Vec<Scene>, most: usize) -> Vec<Scene> {
    let step = scenes.len().div_ceil(most).max(1);
    scenes.into_iter().step_by(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_scenes::{car, scene_of};

    #[test]
    fn objects_that_move_by_more_than_a_metre_are_moving() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 9.0, 0.0)], &[car(0, 0.9, 0.0), car(1, 9.0, 1.1)]]);
        assert!(!scene.is_moving(ObjectId(0)));
        assert!(scene.is_moving(ObjectId(1)));
        let statistics = Statistics::of(&[scene]);
        assert_eq!((statistics.boxes, statistics.moving_boxes, statistics.objects), (4, 2, 2));
    }
}
