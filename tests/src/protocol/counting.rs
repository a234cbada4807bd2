//! How errors are counted: by identity, false positives included (paper, section II-C; METHODS.md 0).

use super::moments::Moments;
use super::scene::{Scene, TrueBox};
use serde::Serialize;
use v2x_common::geometry::{BevBox, angle_difference};

/// A box that a method tells of, and the place in the keyframe of the object that it is scored against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// The box.
    pub bev: BevBox,
    /// By the identity of agent 1's detection in it, else of agent 2's.
    pub object: usize,
}

/// What the errors are divided by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Counting {
    /// The errors of all boxes over the number of true positives: what the paper's tables hold.
    Table,
    /// Over the number of all boxes: the formula as the paper prints it (eq. 5-7).
    Printed,
}

impl Counting {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Table, Self::Printed];
}

/// Which objects are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subset {
    /// All.
    All,
    /// Those that stay within 1 m of where they were first.
    Static,
    /// The others.
    Moving,
}

impl Subset {
    /// All three.
    pub const ALL: [Self; 3] = [Self::All, Self::Static, Self::Moving];
}

/// Sums over one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameCount {
    /// Sums of the errors of all boxes: translation (m), dimension (m), orientation (degrees).
    errors: [f64; 3],
    predictions: u32,
    true_positives: u32,
    objects: u32,
}

impl FrameCount {
    /// Of a frame. Of several boxes of one object one is a true positive, the others are false ones; since the
    /// errors of both add up, it does not matter here which one is the closest.
    pub fn of(predictions: &[Prediction], objects: &[TrueBox], counts: impl Fn(&TrueBox) -> bool) -> Self {
        let mut frame = Self::default();
        let mut is_found = vec![false; objects.len()];
        for Prediction { bev, object } in predictions {
            let truth = &objects[*object];
            if !counts(truth) {
                continue;
            }
            frame.predictions += 1;
            frame.true_positives += u32::from(!is_found[*object]);
            is_found[*object] = true;
            for (sum, error) in frame.errors.iter_mut().zip(errors(bev, &truth.bev)) {
                *sum += error;
            }
        }
        let n_objects = objects.iter().filter(|object| counts(object)).count();
        frame.objects = u32::try_from(n_objects).expect("frames have fewer than 2^32 objects");
        frame
    }

    /// The mean errors; `None` where nothing was found.
    fn mean_errors(&self, counting: Counting) -> Option<[f64; 3]> {
        let divisor = match counting {
            Counting::Table => self.true_positives,
            Counting::Printed => self.predictions,
        };
        (divisor > 0).then(|| self.errors.map(|sum| sum / f64::from(divisor)))
    }

    fn precision(&self) -> Option<f64> {
        (self.predictions > 0).then(|| f64::from(self.true_positives) / f64::from(self.predictions))
    }

    fn recall(&self) -> Option<f64> {
        (self.objects > 0).then(|| f64::from(self.true_positives) / f64::from(self.objects))
    }
}

/// Translation (m), dimension (m), orientation (degrees): eq. (5)-(7) of the paper.
fn errors(told: &BevBox, truth: &BevBox) -> [f64; 3] {
    let distance = |a: f64, b: f64| libm::sqrt(a * a + b * b);
    [
        distance(told.x - truth.x, told.y - truth.y),
        distance(told.w - truth.w, told.d - truth.d),
        angle_difference(told.yaw, truth.yaw).abs().to_degrees(),
    ]
}

/// Moments over frames of one subset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SubsetScore {
    /// By [`Counting`]: translation (m), dimension (m), orientation (degrees).
    errors: [[Moments; 3]; 2],
    /// Fractions.
    precision: Moments,
    recall: Moments,
}

impl SubsetScore {
    fn add(&mut self, frame: &FrameCount) {
        for (moments, counting) in self.errors.iter_mut().zip(Counting::ALL) {
            let means = frame.mean_errors(counting);
            for (axis, moments) in moments.iter_mut().enumerate() {
                moments.add(means.map(|means| means[axis]));
            }
        }
        self.precision.add(frame.precision());
        self.recall.add(frame.recall());
    }

    fn merge(&mut self, other: &Self) {
        let (ours, theirs) = (self.errors.as_flattened_mut(), other.errors.as_flattened());
        ours.iter_mut().zip(theirs).for_each(|(ours, theirs)| ours.merge(theirs));
        self.precision.merge(&other.precision);
        self.recall.merge(&other.recall);
    }

    /// mATE (m), mADE (m), mAOE (degrees), precision, recall.
    pub fn metrics(&self, counting: Counting) -> [Moments; 5] {
        let [ate, ade, aoe] = self.errors[counting as usize];
        [ate, ade, aoe, self.precision, self.recall]
    }
}

/// Moments over frames, by [`Subset`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score([SubsetScore; 3]);

impl Score {
    /// Adds a frame of a scene.
    pub fn add(&mut self, predictions: &[Prediction], scene: &Scene, frame: usize) {
        let objects = &scene.keyframes[frame].objects;
        let is_moving = |object: &TrueBox| scene.is_moving(object.id);
        self.0[Subset::All as usize].add(&FrameCount::of(predictions, objects, |_| true));
        self.0[Subset::Static as usize].add(&FrameCount::of(predictions, objects, |one| !is_moving(one)));
        self.0[Subset::Moving as usize].add(&FrameCount::of(predictions, objects, is_moving));
    }

    /// Adds another one's frames.
    pub fn merge(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(ours, theirs)| ours.merge(theirs));
    }

    /// Of one subset.
    pub const fn of(&self, subset: Subset) -> &SubsetScore {
        &self.0[subset as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{car, scene_of};
    use super::*;

    fn told(object: usize, x: f64, y: f64) -> Prediction {
        Prediction { bev: BevBox { w: 2.0, d: 4.0, ..car(0, x, y).bev }, object }
    }

    fn means(score: &Score, subset: Subset, counting: Counting) -> [Option<f64>; 5] {
        score.of(subset).metrics(counting).map(|moments| moments.mean())
    }

    #[test]
    fn false_positives_add_their_errors_to_those_of_the_true_ones() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)]]);
        let mut score = Score::default();
        // The first object twice, 1 m and 2 m off; the second once, exact.
        score.add(&[told(0, 1.0, 0.0), told(0, 0.0, 2.0), told(1, 20.0, 0.0)], &scene, 0);
        let table = means(&score, Subset::All, Counting::Table);
        assert_eq!((table[0], table[3], table[4]), (Some(1.5), Some(2.0 / 3.0), Some(1.0)));
        assert_eq!(means(&score, Subset::All, Counting::Printed)[0], Some(1.0));
    }

    #[test]
    fn sizes_and_headings_have_their_own_errors() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let bev = BevBox { w: 5.0, d: 8.0, yaw: -3.0, ..car(0, 0.0, 0.0).bev };
        let mut score = Score::default();
        score.add(&[Prediction { bev, object: 0 }], &scene, 0);
        let [ate, ade, aoe, ..] = means(&score, Subset::All, Counting::Table);
        assert_eq!((ate, ade), (Some(0.0), Some(5.0)));
        assert!((aoe.unwrap() - 3f64.to_degrees()).abs() < 1e-12);
    }

    #[test]
    fn subsets_hold_their_own_objects_and_frames_without_any_do_not_count() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0), car(1, 20.0, 0.0)], &[car(1, 25.0, 0.0)]]);
        let mut score = Score::default();
        score.add(&[told(0, 3.0, 0.0), told(1, 20.0, 0.5)], &scene, 0);
        score.add(&[told(0, 25.0, 0.5)], &scene, 1);
        assert_eq!(means(&score, Subset::Static, Counting::Table)[0], Some(3.0));
        assert_eq!(means(&score, Subset::Moving, Counting::Table)[0], Some(0.5));
        assert_eq!(score.of(Subset::Static).metrics(Counting::Table)[4].n(), 1);
    }

    #[test]
    fn a_frame_in_which_nothing_was_found_has_recall_0_and_no_errors() {
        let scene = scene_of(&[&[car(0, 0.0, 0.0)]]);
        let mut score = Score::default();
        score.add(&[], &scene, 0);
        assert_eq!(means(&score, Subset::All, Counting::Table), [None, None, None, None, Some(0.0)]);
    }
}
