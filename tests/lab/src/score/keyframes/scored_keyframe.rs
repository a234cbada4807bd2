//! One keyframe: true objects and published boxes, matched.

use crate::data::fused_box::FusedBox;
use crate::data::scene::{Scene, TrueBox};
use crate::score::estimate::Estimate;
use crate::score::matching::{Frame, Matching, MatchingRule, Outcome, Repeats};
use v2x_agent::truth::ObjectId;
use v2x_fusion_hub::association::assignment::Assigner;

/// One keyframe.
#[derive(Clone, Debug)]
pub(crate) struct ScoredKeyframe<'a> {
    /// Its scene.
    pub scene: &'a Scene,
    /// Its place in the scene.
    pub frame: usize,
    /// All objects of the keyframe.
    pub truth: &'a [TrueBox],
    /// The published boxes.
    pub boxes: &'a [FusedBox],
    /// The pairs, by the provenance of measurements.
    pub matching: Matching,
    estimates: Vec<Estimate>,
    is_in_view: &'a [bool],
}

impl<'a> ScoredKeyframe<'a> {
    /// A keyframe of a scene; `is_in_view` says of each object whether any agent covers it. Boxes of other objects are
    /// ignored.
    pub(crate) fn new(scene: &'a Scene, frame: usize, is_in_view: &'a [bool], boxes: &'a [FusedBox]) -> Self {
        let truth = &scene.keyframes[frame].objects;
        let mut place_of = vec![None; scene.n_objects()];
        for (place, object) in truth.iter().enumerate() {
            place_of[object.id.0 as usize] = Some(place);
        }
        let place = |id: ObjectId| place_of.get(id.0 as usize).copied().flatten();
        let places: Vec<_> = boxes.iter().map(|one| one.object.and_then(place)).collect();
        let estimates: Vec<_> = boxes.iter().map(Estimate::from).collect();
        let rule = MatchingRule::ByProvenance { places: &places, repeats: Repeats::ErrorsAddUp };
        let unmatched =
            Self { scene, frame, truth, boxes, matching: Matching::default(), estimates, is_in_view };
        let matching = unmatched.frame().matched(rule, &mut Assigner::default());
        Self { matching, ..unmatched }
    }

    /// The frame that is matched.
    pub(crate) fn frame(&self) -> Frame<'_> {
        Frame { estimates: &self.estimates, truth: self.truth, counts: self.is_in_view }
    }

    /// Of each object whether any agent covers it.
    pub(crate) const fn is_in_view(&self) -> &'a [bool] {
        self.is_in_view
    }

    /// The objects that count.
    pub(crate) fn objects(&self) -> impl Iterator<Item = &'a TrueBox> + use<'a> {
        self.truth
            .iter()
            .zip(self.is_in_view)
            .filter(|(_, is_in_view)| **is_in_view)
            .map(|(object, _)| object)
    }

    /// The boxes that count.
    pub(crate) fn counted_boxes(&self) -> impl Iterator<Item = &'a FusedBox> {
        let counted = self.boxes.iter().zip(&self.matching.outcomes);
        counted.filter(|(_, outcome)| **outcome != Outcome::Ignored).map(|(one, _)| one)
    }

    /// The boxes of objects that count, with the objects.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (&'a FusedBox, &'a TrueBox)> {
        let pairs = self.boxes.iter().zip(&self.matching.outcomes);
        pairs.filter_map(|(one, outcome)| Some((one, &self.truth[outcome.place()?])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_scenes::{car, fused_car, scene_of};

    #[test]
    fn estimates_of_uncounted_objects_are_ignored() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0), car(2, 40.0, 0.0)]]);
        let gone = FusedBox { object: Some(ObjectId(9)), ..fused_car(0, 0.0, 0.0) };
        let clutter = FusedBox { object: None, ..fused_car(0, 0.0, 0.0) };
        let boxes = [fused_car(1, 20.0, 0.0), fused_car(2, 40.0, 0.0), gone, clutter];
        let keyframe = ScoredKeyframe::new(&scene, 0, &[true, false, true], &boxes);
        assert_eq!(keyframe.objects().map(|one| one.id.0).collect::<Vec<_>>(), [0, 2]);
        use Outcome::{False, Ignored, Matched};
        assert_eq!(keyframe.matching.outcomes, [Ignored, Matched(2), False, False]);
        assert_eq!(keyframe.matching.missed, [0]);
    }
}
