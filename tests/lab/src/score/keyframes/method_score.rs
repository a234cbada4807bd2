//! The score of a method over keyframes. Scores are merged by adding.

use crate::data::fused_box::FusedBox;
use crate::data::scene::TrueBox;
use crate::score::errors::{BoxError, SizeNorm};
use crate::score::frame_errors::FrameErrors;
use crate::score::keyframes::counting::{Counting, Subset, SubsetScore, mean_errors};
use crate::score::keyframes::scored_keyframe::ScoredKeyframe;
use crate::score::moments::Moments;
use crate::score::tracking::nees::{Claim, Consistency};
use crate::score::tracking::scale::scale_error;
use v2x_common::class::Class;
use v2x_common::covariance::{BoxCovariance, Covariance2};

/// The score of a method on one class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClassScore {
    /// The class.
    pub class: Class,
    /// Translation (m), dimension (m), orientation (degrees), per frame, counted as in the paper's tables.
    pub errors: [Moments; 3],
    /// 1 − IoU of the aligned boxes (nuScenes' ASE).
    pub scale: Moments,
    /// Consistency of the published covariances with the errors.
    pub consistency: Consistency,
}

/// The score of a method.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MethodScore {
    subsets: [SubsetScore; 3],
    /// The scores by class.
    classes: Vec<ClassScore>,
}

impl MethodScore {
    /// Adds a keyframe.
    pub(crate) fn add(&mut self, keyframe: &ScoredKeyframe<'_>) {
        let errors = FrameErrors::of(&keyframe.frame(), &keyframe.matching, SizeNorm::RootOfSquares);
        let of_objects = |is_meant: &dyn Fn(&TrueBox) -> bool| {
            errors.sums(|place| place.is_some_and(|place| is_meant(&keyframe.truth[place])))
        };
        let moves = |object: &TrueBox| keyframe.scene.is_moving(object.id);
        self.subsets[Subset::All as usize].add(&errors.sums(|_| true));
        self.subsets[Subset::Static as usize].add(&of_objects(&|object| !moves(object)));
        self.subsets[Subset::Moving as usize].add(&of_objects(&moves));
        let mut classes: Vec<Class> = keyframe.objects().map(|object| object.class).collect();
        classes.sort_unstable();
        classes.dedup();
        for class in classes {
            let sums = of_objects(&|object| object.class == class);
            add_means(&mut self.class_mut(class).errors, mean_errors(&sums, Counting::Table));
        }
        for (fused, truth) in keyframe.pairs() {
            let score = self.class_mut(truth.class);
            score.scale.add(Some(scale_error(&fused.bev, &truth.bev)));
            // A method without valid covariances has no NEES.
            let _ = score.consistency.add(&BoxError::between(&fused.bev, &truth.bev), &claim(fused));
        }
    }

    fn class_mut(&mut self, class: Class) -> &mut ClassScore {
        let place = match self.classes.binary_search_by_key(&class, |one| one.class) {
            Ok(place) => place,
            Err(place) => {
                let (errors, scale) = ([Moments::default(); 3], Moments::default());
                let consistency = Consistency::default();
                self.classes.insert(place, ClassScore { class, errors, scale, consistency });
                place
            }
        };
        &mut self.classes[place]
    }

    /// Adds the frames of another score.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.subsets.iter_mut().zip(&other.subsets).for_each(|(ours, theirs)| ours.merge(theirs));
        for theirs in &other.classes {
            let ours = self.class_mut(theirs.class);
            ours.errors.iter_mut().zip(&theirs.errors).for_each(|(ours, theirs)| ours.merge(theirs));
            ours.scale.merge(&theirs.scale);
            ours.consistency.merge(&theirs.consistency);
        }
    }

    /// The score of one subset.
    pub(crate) const fn of(&self, subset: Subset) -> &SubsetScore {
        &self.subsets[subset as usize]
    }

    /// 1 − IoU of all boxes with those of their objects, aligned (nuScenes' ASE).
    pub(crate) fn scale(&self) -> Moments {
        let mut scale = Moments::default();
        self.classes.iter().for_each(|class| scale.merge(&class.scale));
        scale
    }

    /// By class.
    pub(crate) fn classes(&self) -> &[ClassScore] {
        &self.classes
    }
}

fn add_means(moments: &mut [Moments; 3], means: Option<[f64; 3]>) {
    for (axis, moments) in moments.iter_mut().enumerate() {
        moments.add(means.map(|means| means[axis]));
    }
}

/// The published covariance of a box.
fn claim(fused: &FusedBox) -> Claim {
    let BoxCovariance { position, ww, dd, yaw } = fused.covariance;
    Claim { position, yaw, size: Covariance2 { xx: ww, xy: 0.0, yy: dd } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::scene::Scene;
    use crate::data::test_scenes::{car, fused_car, scene_of};
    use v2x_common::geometry::BevBox;

    fn add(score: &mut MethodScore, boxes: &[FusedBox], scene: &Scene, frame: usize) {
        let is_in_view = vec![true; scene.keyframes[frame].objects.len()];
        score.add(&ScoredKeyframe::new(scene, frame, &is_in_view, boxes));
    }

    fn means(score: &MethodScore, subset: Subset, counting: Counting) -> [Option<f64>; 5] {
        score.of(subset).metrics(counting).map(|moments| moments.mean())
    }

    #[test]
    fn false_positives_add_their_errors_to_those_of_the_true_ones() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)]]);
        let mut score = MethodScore::default();
        // The first object twice, 1 m and 2 m off; the second once, exact.
        add(
            &mut score,
            &[fused_car(0, 1.0, 0.0), fused_car(0, 0.0, 2.0), fused_car(1, 20.0, 0.0)],
            &scene,
            0,
        );
        let table = means(&score, Subset::All, Counting::Table);
        assert_eq!((table[0], table[3], table[4]), (Some(1.5), Some(2.0 / 3.0), Some(1.0)));
        assert_eq!(means(&score, Subset::All, Counting::Printed)[0], Some(1.0));
    }

    #[test]
    fn sizes_and_headings_have_their_own_errors() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let bev = BevBox { w: 5.0, d: 8.0, yaw: -3.0, ..car(0, 0.0, 0.0).bev };
        let mut score = MethodScore::default();
        add(&mut score, &[FusedBox { bev, ..fused_car(0, 0.0, 0.0) }], &scene, 0);
        let [ate, ade, aoe, ..] = means(&score, Subset::All, Counting::Table);
        assert_eq!((ate, ade), (Some(0.0), Some(5.0)));
        assert!((aoe.unwrap() - 3f64.to_degrees()).abs() < 1e-12);
    }

    #[test]
    fn subsets_hold_their_own_objects_and_frames_without_any_do_not_count() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)], &[car(1, 25.0, 0.0)]]);
        let mut score = MethodScore::default();
        add(&mut score, &[fused_car(0, 3.0, 0.0), fused_car(1, 20.0, 0.5)], &scene, 0);
        add(&mut score, &[fused_car(0, 25.0, 0.5)], &scene, 1);
        assert_eq!(means(&score, Subset::Static, Counting::Table)[0], Some(3.0));
        assert_eq!(means(&score, Subset::Moving, Counting::Table)[0], Some(0.5));
        assert_eq!(score.of(Subset::Static).metrics(Counting::Table)[4].n(), 1);
    }

    #[test]
    fn a_frame_without_matches_has_recall_zero_and_no_errors() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let mut score = MethodScore::default();
        add(&mut score, &[], &scene, 0);
        assert_eq!(means(&score, Subset::All, Counting::Table), [None, None, None, None, Some(0.0)]);
    }

    #[test]
    fn with_the_first_rule_only_the_first_box_of_an_object_is_scored() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)]]);
        let mut score = MethodScore::default();
        add(
            &mut score,
            &[fused_car(0, 1.0, 0.0), fused_car(0, 0.0, 2.0), fused_car(1, 20.0, 0.0)],
            &scene,
            0,
        );
        assert_eq!(means(&score, Subset::All, Counting::FirstBoxes)[0], Some(0.5));
    }

    #[test]
    fn a_false_object_lowers_precision_only() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let mut score = MethodScore::default();
        let clutter = FusedBox { object: None, ..fused_car(0, 50.0, 0.0) };
        add(&mut score, &[fused_car(0, 1.0, 0.0), clutter], &scene, 0);
        let [ate, _, _, precision, recall] = means(&score, Subset::All, Counting::Table);
        assert_eq!((ate, precision, recall), (Some(1.0), Some(0.5), Some(1.0)));
        assert_eq!(score.classes()[0].errors[0].mean(), Some(1.0));
    }

    #[test]
    fn reported_accuracies_are_compared_with_the_errors_of_their_class() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let mut score = MethodScore::default();
        // σ 0.5 m: 1 m off along one axis is 4 over 2 degrees of freedom.
        add(&mut score, &[fused_car(0, 1.0, 0.0)], &scene, 0);
        let [class] = score.classes() else { panic!("one class") };
        assert!((class.consistency.position.mean().unwrap() - 2.0).abs() < 1e-9);
        assert_eq!((class.consistency.size.mean(), class.scale.mean()), (Some(0.0), Some(0.0)));
    }
}
