//! How a method did: sums over keyframes that add up.

use super::counting::{Counting, FrameCount, Subset, SubsetScore};
use super::instant::Instant;
use super::moments::Moments;
use super::prediction::Prediction;
use v2x_common::class::Class;
use v2x_common::covariance::BoxCovariance;
use v2x_common::geometry::{BevBox, angle_difference};

/// How a method did on one class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassScore {
    /// Which class.
    pub class: Class,
    /// Translation (m), dimension (m), orientation (degrees), per frame, counted as the paper's tables are.
    pub errors: [Moments; 3],
    /// 1 − IoU of the boxes, laid over each other.
    pub scale: Moments,
    /// Squared errors over claimed variances, per degree of freedom: position, heading, size.
    pub nees: [Moments; 3],
}

/// Sums over keyframes, of one method.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    subsets: [SubsetScore; 3],
    /// By class.
    classes: Vec<ClassScore>,
}

impl Score {
    /// Adds a keyframe.
    pub fn add(&mut self, instant: &Instant<'_>) {
        let is_moving = |id| instant.scene.is_moving(id);
        self.subsets[Subset::All as usize].add(&FrameCount::of(instant, |_| true));
        let of_kind =
            |moves: bool| FrameCount::of(instant, |one| one.is_some_and(|one| is_moving(one.id) == moves));
        self.subsets[Subset::Static as usize].add(&of_kind(false));
        self.subsets[Subset::Moving as usize].add(&of_kind(true));
        self.add_classes(instant);
    }

    fn add_classes(&mut self, instant: &Instant<'_>) {
        let mut classes: Vec<Class> = instant.objects.iter().map(|one| one.class).collect();
        classes.sort_unstable();
        classes.dedup();
        for class in classes {
            let count = FrameCount::of(instant, |one| one.is_some_and(|one| one.class == class));
            add_means(&mut self.class_mut(class).errors, count.mean_errors(Counting::Table));
        }
        for told in &instant.told {
            let Some(place) = told.place else { continue };
            let truth = instant.objects[place];
            let prediction = told.prediction;
            let score = self.class_mut(truth.class);
            score.scale.add(Some(1.0 - aligned_iou(&prediction.bev, &truth.bev)));
            let nees = normalised_errors(prediction, &truth.bev);
            score.nees.iter_mut().zip(nees).for_each(|(sum, nees)| sum.add(Some(nees)));
        }
    }

    fn class_mut(&mut self, class: Class) -> &mut ClassScore {
        let place = match self.classes.binary_search_by_key(&class, |one| one.class) {
            Ok(place) => place,
            Err(place) => {
                let [errors, nees] = [[Moments::default(); 3]; 2];
                self.classes.insert(place, ClassScore { class, errors, scale: Moments::default(), nees });
                place
            }
        };
        &mut self.classes[place]
    }

    /// Adds another one's frames.
    pub fn merge(&mut self, other: &Self) {
        self.subsets.iter_mut().zip(&other.subsets).for_each(|(ours, theirs)| ours.merge(theirs));
        for theirs in &other.classes {
            let ours = self.class_mut(theirs.class);
            merge_all(&mut ours.errors, &theirs.errors);
            merge_all(&mut ours.nees, &theirs.nees);
            ours.scale.merge(&theirs.scale);
        }
    }

    /// Of one subset.
    pub const fn of(&self, subset: Subset) -> &SubsetScore {
        &self.subsets[subset as usize]
    }

    /// By class.
    pub fn classes(&self) -> &[ClassScore] {
        &self.classes
    }
}

fn add_means(moments: &mut [Moments; 3], means: Option<[f64; 3]>) {
    for (axis, moments) in moments.iter_mut().enumerate() {
        moments.add(means.map(|means| means[axis]));
    }
}

fn merge_all(ours: &mut [Moments; 3], theirs: &[Moments; 3]) {
    ours.iter_mut().zip(theirs).for_each(|(ours, theirs)| ours.merge(theirs));
}

/// Overlap (IoU) of two boxes with one centre and one heading.
fn aligned_iou(a: &BevBox, b: &BevBox) -> f64 {
    let intersection = a.w.min(b.w) * a.d.min(b.d);
    intersection / (a.w * a.d + b.w * b.d - intersection)
}

/// Squared errors over claimed variances, per degree of freedom: position (2), heading (1), size (2).
fn normalised_errors(told: &Prediction, truth: &BevBox) -> [f64; 3] {
    let BoxCovariance { position: p, ww, dd, yaw } = told.covariance;
    let (dx, dy) = (told.bev.x - truth.x, told.bev.y - truth.y);
    let position = (p.yy * dx * dx - 2.0 * p.xy * dx * dy + p.xx * dy * dy) / p.determinant();
    let turn = angle_difference(told.bev.yaw, truth.yaw);
    let (dw, dd_m) = (told.bev.w - truth.w, told.bev.d - truth.d);
    [position / 2.0, turn * turn / yaw, (dw * dw / ww + dd_m * dd_m / dd) / 2.0]
}

#[cfg(test)]
mod tests {
    use super::super::scene::Scene;
    use super::super::testing::{car, scene_of, told};
    use super::*;
    use v2x_common::covariance::Covariance2;

    fn add(score: &mut Score, predictions: &[Prediction], scene: &Scene, frame: usize) {
        score.add(&Instant::complete(scene, frame, predictions));
    }

    fn means(score: &Score, subset: Subset, counting: Counting) -> [Option<f64>; 5] {
        score.of(subset).metrics(counting).map(|moments| moments.mean())
    }

    #[test]
    fn false_positives_add_their_errors_to_those_of_the_true_ones() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)]]);
        let mut score = Score::default();
        // The first object twice, 1 m and 2 m off; the second once, exact.
        add(&mut score, &[told(0, 1.0, 0.0), told(0, 0.0, 2.0), told(1, 20.0, 0.0)], &scene, 0);
        let table = means(&score, Subset::All, Counting::Table);
        assert_eq!((table[0], table[3], table[4]), (Some(1.5), Some(2.0 / 3.0), Some(1.0)));
        assert_eq!(means(&score, Subset::All, Counting::Printed)[0], Some(1.0));
    }

    #[test]
    fn sizes_and_headings_have_their_own_errors() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let bev = BevBox { w: 5.0, d: 8.0, yaw: -3.0, ..car(0, 0.0, 0.0).bev };
        let mut score = Score::default();
        add(&mut score, &[Prediction { bev, ..told(0, 0.0, 0.0) }], &scene, 0);
        let [ate, ade, aoe, ..] = means(&score, Subset::All, Counting::Table);
        assert_eq!((ate, ade), (Some(0.0), Some(5.0)));
        assert!((aoe.unwrap() - 3f64.to_degrees()).abs() < 1e-12);
    }

    #[test]
    fn subsets_hold_their_own_objects_and_frames_without_any_do_not_count() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)], &[car(1, 25.0, 0.0)]]);
        let mut score = Score::default();
        add(&mut score, &[told(0, 3.0, 0.0), told(1, 20.0, 0.5)], &scene, 0);
        add(&mut score, &[told(0, 25.0, 0.5)], &scene, 1);
        assert_eq!(means(&score, Subset::Static, Counting::Table)[0], Some(3.0));
        assert_eq!(means(&score, Subset::Moving, Counting::Table)[0], Some(0.5));
        assert_eq!(score.of(Subset::Static).metrics(Counting::Table)[4].n(), 1);
    }

    #[test]
    fn a_frame_in_which_nothing_was_found_has_recall_0_and_no_errors() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let mut score = Score::default();
        add(&mut score, &[], &scene, 0);
        assert_eq!(means(&score, Subset::All, Counting::Table), [None, None, None, None, Some(0.0)]);
    }

    #[test]
    fn elsewhere_only_the_first_box_of_an_object_is_looked_at() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)]]);
        let mut score = Score::default();
        add(&mut score, &[told(0, 1.0, 0.0), told(0, 0.0, 2.0), told(1, 20.0, 0.0)], &scene, 0);
        assert_eq!(means(&score, Subset::All, Counting::FirstBoxes)[0], Some(0.5));
    }

    #[test]
    fn what_is_of_nothing_costs_precision_only() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let mut score = Score::default();
        let clutter = Prediction { object: None, ..told(0, 50.0, 0.0) };
        add(&mut score, &[told(0, 1.0, 0.0), clutter], &scene, 0);
        let [ate, _, _, precision, recall] = means(&score, Subset::All, Counting::Table);
        assert_eq!((ate, precision, recall), (Some(1.0), Some(0.5), Some(1.0)));
        assert_eq!(score.classes()[0].errors[0].mean(), Some(1.0));
    }

    #[test]
    fn normalised_errors_are_one_on_average_where_claims_are_true() {
        let truth = car(0, 0.0, 0.0).bev;
        let one =
            Prediction { bev: BevBox { x: 1.0, y: 1.0, w: 2.5, d: 3.0, yaw: 0.2 }, ..told(0, 0.0, 0.0) };
        let position = Covariance2 { xx: 1.0, xy: 0.0, yy: 1.0 };
        let covariance = BoxCovariance { position, ww: 0.25, dd: 1.0, yaw: 0.04 };
        let nees = normalised_errors(&Prediction { covariance, ..one }, &truth);
        assert!(nees.iter().all(|nees| (nees - 1.0).abs() < 1e-9), "{nees:?}");
        // Along the claimed error, and across it: e' P^-1 e with P = [2 1; 1 2] and e = (1, 1) is 2 / 3.
        let skew = BoxCovariance { position: Covariance2 { xx: 2.0, xy: 1.0, yy: 2.0 }, ..covariance };
        assert!(
            (normalised_errors(&Prediction { covariance: skew, ..one }, &truth)[0] - 1.0 / 3.0).abs() < 1e-9
        );
    }
}
