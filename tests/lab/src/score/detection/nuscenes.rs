//! nuScenes' detection metrics: AP at centre distances, errors of true positives, NDS.
//!
//! nuscenes-devkit, `eval/detection/algo.py` with `detection_cvpr_2019.json` (Caesar et al., CVPR 2020): boxes of a class are
//! matched in the order of their scores to the nearest true box of the class that is still free; AP is the mean of the
//! precision above 0.1 over the recalls above 0.1; an error is the mean, over these recalls, of its mean over the matches up
//! to there. The caller leaves out boxes beyond a range. Means are over the classes with true boxes, where the devkit has all
//! ten. There are no attributes here, so NDS is (5 mAP + Σ max(0, 1 − error)) / 9 with the four errors that are left.

use crate::score::detection::classes::DetectionClass;
use crate::score::detection::interpolation::{cumulative_means, interpolated};
use crate::score::detection::{Scene, Velocities};
use crate::score::errors::distance_m;
use crate::score::tracking::scale::scale_error;
use serde::Serialize;
use v2x_common::geometry::BevBox;

/// Distances of AP, m.
pub const DISTANCES_M: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
/// The place of the distance at which errors are measured: 2 m.
const ERRORS_AT: usize = 2;
/// Recalls are 0, 0.01, … 1; those up to this place are left out.
const N_RECALLS: usize = 101;
const FIRST_RECALL: usize = 11;
/// Multiples of it are the bits of `np.linspace(0, 1, 101)`: a last recall of 0.57 must be met as the devkit meets it.
const RECALL_STEP: f64 = 0.01;
const MIN_PRECISION: f64 = 0.1;

/// Figures of one class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClassFigures {
    /// Which class.
    pub class: DetectionClass,
    /// True boxes.
    pub objects: u64,
    /// Average precision at each of [`DISTANCES_M`].
    pub ap: [f64; 4],
    /// Errors of translation (m), scale (1 − IoU), orientation (rad), velocity (m/s); `None` where the class has none. 1
    /// where no recall above 0.1 is reached.
    pub errors: [Option<f64>; 4],
}

/// Figures of the classes with true boxes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetectionFigures {
    /// In nuScenes' order.
    pub classes: Vec<ClassFigures>,
}

/// A box of one class.
#[derive(Clone, Copy, Debug)]
struct Labelled<'a> {
    bev: &'a BevBox,
    velocity: Option<[f64; 2]>,
}

/// A reported box of one class.
#[derive(Clone, Copy, Debug)]
struct Reported<'a> {
    /// Place of its instant among all instants of all scenes.
    instant: usize,
    score: f64,
    labelled: Labelled<'a>,
}

/// All boxes of one class.
#[derive(Default)]
struct Boxes<'a> {
    /// True ones by instant.
    truth: Vec<Vec<Labelled<'a>>>,
    /// Reported ones by falling score.
    reported: Vec<Reported<'a>>,
}

/// A true positive.
struct Match {
    score: f64,
    errors: [Option<f64>; 4],
}

/// Precision and errors by recall.
struct Curve {
    precision: [f64; N_RECALLS],
    confidence: [f64; N_RECALLS],
    errors: [[f64; N_RECALLS]; 4],
}

impl DetectionFigures {
    /// Of these scenes.
    pub fn of(scenes: &[Scene<'_>]) -> Self {
        Self { classes: DetectionClass::ALL.into_iter().filter_map(|class| figures(scenes, class)).collect() }
    }

    /// The mean over classes and distances; `None` without true boxes.
    pub fn map(&self) -> Option<f64> {
        let by_distance = self.ap();
        by_distance.map(|ap| ap.iter().sum::<f64>() / 4.0)
    }

    /// The mean over classes at each of [`DISTANCES_M`].
    #[expect(clippy::cast_precision_loss, reason = "ten classes")]
    pub fn ap(&self) -> Option<[f64; 4]> {
        let n = self.classes.len() as f64;
        let mean = |place: usize| self.classes.iter().map(|class| class.ap[place]).sum::<f64>() / n;
        (n > 0.0).then(|| [0, 1, 2, 3].map(mean))
    }

    /// The means over classes of the errors of translation (m), scale (1 − IoU), orientation (rad) and velocity (m/s), over
    /// the classes that have each.
    pub fn errors(&self) -> [Option<f64>; 4] {
        [0, 1, 2, 3].map(|kind| {
            let values: Vec<f64> = self.classes.iter().filter_map(|class| class.errors[kind]).collect();
            #[expect(clippy::cast_precision_loss, reason = "ten classes")]
            let n = values.len() as f64;
            (n > 0.0).then(|| values.iter().sum::<f64>() / n)
        })
    }

    /// The nuScenes detection score without attributes: (5 mAP + Σ max(0, 1 − error)) / 9. An error that no class has counts
    /// as 1.
    pub fn nds(&self) -> Option<f64> {
        let parts: f64 = self.errors().iter().map(|error| (1.0 - error.unwrap_or(1.0)).max(0.0)).sum();
        Some((5.0 * self.map()? + parts) / 9.0)
    }
}

/// `None` without true boxes of the class.
fn figures(scenes: &[Scene<'_>], class: DetectionClass) -> Option<ClassFigures> {
    let boxes = Boxes::of(scenes, class);
    let objects: usize = boxes.truth.iter().map(Vec::len).sum();
    if objects == 0 {
        return None;
    }
    let curves = DISTANCES_M.map(|distance_m| boxes.curve(class, objects, distance_m));
    let error = |kind: usize| curves[ERRORS_AT].as_ref().map_or(1.0, |curve| curve.mean_error(kind));
    let counts = class.counts();
    Some(ClassFigures {
        class,
        objects: objects as u64,
        ap: curves.each_ref().map(|curve| curve.as_ref().map_or(0.0, Curve::ap)),
        errors: [0, 1, 2, 3].map(|kind| counts[kind].then(|| error(kind))),
    })
}

impl<'a> Boxes<'a> {
    fn of(scenes: &[Scene<'a>], class: DetectionClass) -> Self {
        let none = Velocities::default();
        let mut boxes = Self::default();
        for scene in scenes {
            for (number, instant) in scene.sequence.instants().iter().enumerate() {
                let velocities = scene.velocities.get(number).unwrap_or(&none);
                let velocity = |of: &[Option<[f64; 2]>], place: usize| of.get(place).copied().flatten();
                let is_its = |of| DetectionClass::of(of) == Some(class);
                let truth = instant.truth.iter().enumerate().filter(|(_, one)| is_its(one.class));
                let labelled = truth.map(|(place, one)| Labelled {
                    bev: &one.bev,
                    velocity: velocity(&velocities.truth, place),
                });
                let place_of_instant = boxes.truth.len();
                boxes.truth.push(labelled.collect());
                let reported = instant.reported.iter().enumerate().filter(|(_, one)| is_its(one.class));
                boxes.reported.extend(reported.map(|(place, one)| Reported {
                    instant: place_of_instant,
                    score: one.score,
                    labelled: Labelled { bev: &one.bev, velocity: velocity(&velocities.reported, place) },
                }));
            }
        }
        // Of equal scores the devkit takes the last one first.
        boxes.reported.reverse();
        boxes.reported.sort_by(|a, b| b.score.total_cmp(&a.score));
        boxes
    }

    /// `None` without a match.
    #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
    fn curve(&self, class: DetectionClass, objects: usize, distance_m: f64) -> Option<Curve> {
        let mut is_taken: Vec<Vec<bool>> = self.truth.iter().map(|truth| vec![false; truth.len()]).collect();
        let (mut matches, mut recalls, mut precisions, mut scores) = (vec![], vec![], vec![], vec![]);
        for (number, reported) in self.reported.iter().enumerate() {
            let (truth, is_taken) = (&self.truth[reported.instant], &mut is_taken[reported.instant]);
            if let Some(place) = nearest(truth, is_taken, reported.labelled.bev, distance_m) {
                is_taken[place] = true;
                let errors = errors(class, &reported.labelled, &truth[place]);
                matches.push(Match { score: reported.score, errors });
            }
            recalls.push(matches.len() as f64 / objects as f64);
            precisions.push(matches.len() as f64 / (number + 1) as f64);
            scores.push(reported.score);
        }
        (!matches.is_empty()).then(|| Curve::of(&recalls, (&precisions, &scores), &matches))
    }
}

/// The place of the nearest free box, nearer than `within_m`.
fn nearest(truth: &[Labelled<'_>], is_taken: &[bool], bev: &BevBox, within_m: f64) -> Option<usize> {
    let mut best = (within_m, None);
    for (place, (one, is_taken)) in truth.iter().zip(is_taken).enumerate() {
        let distance = distance_m(bev, one.bev);
        if !is_taken && distance < best.0 {
            best = (distance, Some(place));
        }
    }
    best.1
}

fn errors(class: DetectionClass, reported: &Labelled<'_>, truth: &Labelled<'_>) -> [Option<f64>; 4] {
    let (a, b) = (reported.bev, truth.bev);
    let velocity = reported.velocity.zip(truth.velocity);
    let period = class.period_rad();
    let turn = (b.yaw - a.yaw) / period;
    [
        Some(distance_m(a, b)),
        Some(scale_error(a, b)),
        Some(((turn - libm::round(turn)) * period).abs()),
        velocity.map(|(a, b)| libm::hypot(a[0] - b[0], a[1] - b[1])),
    ]
}

impl Curve {
    #[expect(clippy::cast_precision_loss, reason = "below 101")]
    fn of(recalls: &[f64], (precisions, scores): (&[f64], &[f64]), matches: &[Match]) -> Self {
        let by_recall = |values: &[f64]| {
            let mut curve = [0.0; N_RECALLS];
            for (place, value) in curve.iter_mut().enumerate() {
                *value = interpolated(place as f64 * RECALL_STEP, (recalls, values), 0.0);
            }
            curve
        };
        let confidence = by_recall(scores);
        let error = |kind: usize| {
            let means = cumulative_means(matches.iter().map(|one| one.errors[kind]));
            // From low to high confidence, as interpolation wants it. Existence probabilities have a largest value that
            // many boxes share: they count together, where the devkit would take the error of one of them for all.
            let mut points: Vec<(f64, f64)> = matches.iter().map(|one| one.score).zip(means).rev().collect();
            points.dedup_by_key(|(score, _)| *score);
            let (rising, means): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
            let right = means.last().copied().unwrap_or(1.0);
            confidence.map(|score| interpolated(score, (&rising, &means), right))
        };
        Self { precision: by_recall(precisions), confidence, errors: [0, 1, 2, 3].map(error) }
    }

    #[expect(clippy::cast_precision_loss, reason = "below 101")]
    fn ap(&self) -> f64 {
        let above = &self.precision[FIRST_RECALL..];
        let sum: f64 = above.iter().map(|precision| (precision - MIN_PRECISION).max(0.0)).sum();
        sum / above.len() as f64 / (1.0 - MIN_PRECISION)
    }

    /// The mean over the recalls that are reached; 1 where none above 0.1 is.
    #[expect(clippy::cast_precision_loss, reason = "below 101")]
    fn mean_error(&self, kind: usize) -> f64 {
        let last = self.confidence.iter().rposition(|score| *score != 0.0).unwrap_or(0);
        if last < FIRST_RECALL {
            return 1.0;
        }
        let reached = &self.errors[kind][FIRST_RECALL..=last];
        reached.iter().sum::<f64>() / reached.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::tracking::testing::{Xs, sequence};

    fn of(instants: &[Xs]) -> DetectionFigures {
        let sequence = sequence(instants);
        DetectionFigures::of(&[Scene { sequence: &sequence, velocities: &[] }])
    }

    #[test]
    fn perfect_boxes_have_an_ap_of_1_and_unknown_velocities_count_as_1() {
        let figures = of(&[(&[(0, 0.0), (1, 9.0)], &[(7, 9.0), (8, 0.0)])]);
        assert!((figures.map().unwrap() - 1.0).abs() < 1e-12, "{figures:?}");
        assert_eq!(figures.errors(), [Some(0.0), Some(0.0), Some(0.0), Some(1.0)]);
        assert!((figures.nds().unwrap() - 8.0 / 9.0).abs() < 1e-12);
    }

    #[test]
    fn a_distance_decides_at_which_thresholds_a_box_counts() {
        let figures = of(&[(&[(0, 0.0)], &[(7, 1.5)])]);
        let ap = figures.ap().unwrap();
        let is_near = |(ap, expected): (f64, f64)| (ap - expected).abs() < 1e-12;
        assert!(ap.into_iter().zip([0.0, 0.0, 1.0, 1.0]).all(is_near), "{ap:?}");
        let twice = of(&[(&[(0, 0.0)], &[(7, 0.0), (8, 0.1)])]);
        assert!(twice.map().unwrap() < 1.0, "a second box of one object is a false one: {twice:?}");
    }

    #[test]
    fn boxes_of_equal_scores_count_together() {
        let figures = of(&[(&[(0, 0.0), (1, 9.0), (2, 20.0)], &[(7, 0.3), (8, 9.0), (9, 20.0)])]);
        assert!((figures.errors()[0].unwrap() - 0.1).abs() < 1e-12, "{figures:?}");
    }

    #[test]
    fn without_objects_there_are_no_figures() {
        let figures = of(&[(&[], &[(7, 0.0)])]);
        assert_eq!((figures.map(), figures.nds(), figures.errors()), (None, None, [None; 4]));
        let missed = of(&[(&[(0, 0.0)], &[])]);
        assert_eq!((missed.map(), missed.nds()), (Some(0.0), Some(0.0)));
    }
}
