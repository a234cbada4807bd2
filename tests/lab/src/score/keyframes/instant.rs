//! One keyframe as it is scored: what was to be found, and what was told.

use crate::data::prediction::Prediction;
use crate::data::scene::{Scene, TrueBox};
use v2x_agent::truth::ObjectId;

/// What was told of an object, and the place of its truth.
#[derive(Clone, Copy, Debug)]
pub struct Told<'a> {
    /// What was told.
    pub prediction: &'a Prediction,
    /// Place in [`Instant::objects`]; `None` for what is of nothing that is there.
    pub place: Option<usize>,
}

/// One keyframe.
#[derive(Clone, Debug)]
pub struct Instant<'a> {
    /// The scene that it is of.
    pub scene: &'a Scene,
    /// What was to be found.
    pub objects: Vec<&'a TrueBox>,
    /// What was told, but of objects that nobody had to find.
    pub told: Vec<Told<'a>>,
}

impl<'a> Instant<'a> {
    /// A keyframe of a scene; `is_in_view` says of each of its objects whether it was to be found.
    pub fn new(scene: &'a Scene, frame: usize, is_in_view: &[bool], predictions: &'a [Prediction]) -> Self {
        const ABSENT: u32 = u32::MAX;
        const IGNORED: u32 = u32::MAX - 1;
        let mut place_of = vec![ABSENT; scene.n_objects()];
        let mut objects: Vec<&TrueBox> = Vec::new();
        for (object, is_in_view) in scene.keyframes[frame].objects.iter().zip(is_in_view) {
            let place = if *is_in_view { u32::try_from(objects.len()).unwrap_or(IGNORED) } else { IGNORED };
            place_of[object.id.0 as usize] = place;
            if *is_in_view {
                objects.push(object);
            }
        }
        let place = |id: ObjectId| place_of.get(id.0 as usize).copied().unwrap_or(ABSENT);
        let told =
            predictions.iter().filter_map(|prediction| match prediction.object.map_or(ABSENT, place) {
                IGNORED => None,
                ABSENT => Some(Told { prediction, place: None }),
                place => Some(Told { prediction, place: Some(place as usize) }),
            });
        let told = told.collect();
        Self { scene, objects, told }
    }

    /// Everything in the keyframe is to be found.
    pub fn complete(scene: &'a Scene, frame: usize, predictions: &'a [Prediction]) -> Self {
        Self::new(scene, frame, &vec![true; scene.keyframes[frame].objects.len()], predictions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_scenes::{car, scene_of, told};

    #[test]
    fn what_nobody_had_to_find_counts_neither_way() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0), car(2, 40.0, 0.0)]]);
        let gone = Prediction { object: Some(ObjectId(9)), ..told(0, 0.0, 0.0) };
        let clutter = Prediction { object: None, ..told(0, 0.0, 0.0) };
        let predictions = [told(1, 20.0, 0.0), told(2, 40.0, 0.0), gone, clutter];
        let instant = Instant::new(&scene, 0, &[true, false, true], &predictions);
        assert_eq!(instant.objects.iter().map(|one| one.id.0).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(instant.told.iter().map(|one| one.place).collect::<Vec<_>>(), [Some(1), None, None]);
    }
}
