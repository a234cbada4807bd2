//! The ground truth of the tables: scenes of keyframes with true boxes.

use v2x_agent::truth::{ObjectId, TrueObject};
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::time::Span;

/// An object is moving if it gets further than this from its first position, m (deploy/docs/methods.md).
const MOVED_M: f64 = 1.0;
/// Keyframes that are farther apart than this say nothing of a velocity (nuScenes' `max_time_diff`), s.
const MAX_STEP_S: f64 = 1.5;

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

    /// The velocity of an object of a keyframe, m/s: from its place in the keyframe before to that in the one after, or one
    /// of them and its own where the other lacks (nuScenes' `box_velocity`). `None` where it is in neither.
    pub(crate) fn velocity(&self, frame: usize, id: ObjectId) -> Option<[f64; 2]> {
        let at = |frame: usize| {
            let Keyframe { at, objects, .. } = self.keyframes.get(frame)?;
            let object = objects.iter().find(|object| object.id == id)?;
            Some((at.as_secs_f64(), object.bev))
        };
        let (before, own, after) = (frame.checked_sub(1).and_then(at), at(frame)?, at(frame + 1));
        let n_steps = if before.is_some() && after.is_some() { 2.0 } else { 1.0 };
        let ((begin_s, from), (end_s, to)) = (before.unwrap_or(own), after.unwrap_or(own));
        let step_s = end_s - begin_s;
        let is_known = step_s > 0.0 && step_s <= n_steps * MAX_STEP_S;
        is_known.then(|| [(to.x - from.x) / step_s, (to.y - from.y) / step_s])
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

    #[test]
    fn a_velocity_is_the_way_between_the_neighbouring_keyframes() {
        let scene =
            scene_of(&[&[car(0, 0.0, 0.0)], &[car(0, 2.0, 1.0), car(1, 9.0, 0.0)], &[car(0, 6.0, 1.0)]]);
        let step_s = (scene.keyframes[1].at - scene.keyframes[0].at).as_secs_f64();
        let velocity = |frame, id| scene.velocity(frame, ObjectId(id)).map(|v| v.map(|m| m * step_s));
        assert_eq!(velocity(1, 0), Some([3.0, 0.5]));
        assert_eq!((velocity(0, 0), velocity(2, 0)), (Some([2.0, 1.0]), Some([4.0, 0.0])));
        assert_eq!((velocity(1, 1), velocity(0, 1), velocity(3, 0)), (None, None, None));
    }
}
