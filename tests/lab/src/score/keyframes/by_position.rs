//! Matching by position, for methods that name no measurements.

use crate::data::fused_box::FusedBox;
use crate::data::scene::Keyframe;
use crate::score::estimate::Estimate;
use crate::score::matching::{Frame, MatchingRule, PositionRule};
use v2x_fusion_hub::association::assignment::Assigner;

/// The most pairs of compatible class and, among those, the least total distance, at any distance.
const RULE: PositionRule = PositionRule { radius_m: None, is_class_aware: true };

/// Sets the object of each box of a keyframe by its position.
pub(crate) fn assign_objects(boxes: &mut [FusedBox], keyframe: &Keyframe, assigner: &mut Assigner) {
    let estimates: Vec<_> = boxes.iter().map(Estimate::from).collect();
    let counts = vec![true; keyframe.objects.len()];
    let frame = Frame { estimates: &estimates, truth: &keyframe.objects, counts: &counts };
    let matching = frame.matched(MatchingRule::ByPosition(RULE), assigner);
    for (one, outcome) in boxes.iter_mut().zip(matching.outcomes) {
        one.object = outcome.place().map(|place| keyframe.objects[place].id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::test_scenes::{car, fused_car, scene_of};
    use v2x_common::class::Class;

    #[test]
    fn boxes_are_matched_within_a_class_at_any_distance() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 10.0, 0.0), car(2, 20.0, 0.0)]]);
        let mut boxes = [9.0, 11.0, 500.0, 0.0, 90.0].map(|x| fused_car(7, x, 0.0));
        (boxes[3].class, boxes[4].class) = (Class::Truck, Class::Unknown);
        assign_objects(&mut boxes, &scene.keyframes[0], &mut Assigner::default());
        // Three objects for four boxes that may be cars: the least total distance decides which one is of no object. A
        // truck is no car.
        assert_eq!(boxes.map(|one| one.object.map(|id| id.0)), [Some(0), Some(1), None, None, Some(2)]);
    }
}
