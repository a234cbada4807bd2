//! nuScenes' tracking metrics: AMOTA, AMOTP, MOTAR and CLEAR MOT at the best threshold, by class.
//!
//! nuscenes-devkit, `eval/tracking/{evaluate,algo,loaders}.py` with `tracking_nips_2019.json`; AMOTA is of Weng et
//! al., "3D multi-object tracking: a baseline and new evaluation metrics", IROS 2020. Each track has the mean of its
//! scores. The scores of boxes that are matched without a threshold give a threshold for each of 40 recalls. CLEAR MOT is
//! counted at each, over all scenes. Means over thresholds and classes come last. The caller leaves out the boxes that
//! the devkit leaves out for range or missing lidar points.

mod classes;
mod filled;
mod thresholds;

pub use classes::TrackingClass;

use crate::score::tracking::clear::Clear;
use crate::score::tracking::correspondence::correspond;
use crate::score::tracking::indexed::Indexed;
use crate::score::tracking::sequence::{GATE_M, Sequence};
use filled::Filled;
use thresholds::{N_RECALLS, score_thresholds};

/// AMOTP's value for a recall that is not achieved, m (`metric_worst` of the devkit's configuration).
const WORST_MOTP_M: f64 = 2.0;

/// Figures of one class.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClassScore {
    /// Mean of MOTAR over the recalls, 0 for those not achieved; in [0, 1].
    pub amota: f64,
    /// Mean of MOTP over the recalls, 2 m for those not achieved; m.
    pub amotp_m: f64,
    /// True boxes.
    pub objects: u64,
    /// At the threshold of highest MOTA; `None` where nothing was matched.
    pub best: Option<Clear>,
}

/// Figures of the classes with true boxes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NuscenesScore {
    /// In nuScenes' order.
    pub classes: Vec<(TrackingClass, ClassScore)>,
}

impl NuscenesScore {
    /// The figures of these scenes.
    pub fn of(scenes: &[Sequence]) -> Self {
        let filled: Vec<Filled> = scenes.iter().map(Filled::of).collect();
        let class = |class| class_score(&filled, class).map(|score| (class, score));
        Self { classes: TrackingClass::ALL.into_iter().filter_map(class).collect() }
    }

    /// Mean of a figure over the classes; `None` where there are none.
    #[expect(clippy::cast_precision_loss, reason = "seven classes")]
    pub fn mean(&self, figure: impl Fn(&ClassScore) -> f64) -> Option<f64> {
        let sum: f64 = self.classes.iter().map(|(_, score)| figure(score)).sum();
        (!self.classes.is_empty()).then(|| sum / self.classes.len() as f64)
    }

    /// Mean AMOTA.
    pub fn amota(&self) -> Option<f64> {
        self.mean(|score| score.amota)
    }

    /// Mean AMOTP, m.
    pub fn amotp_m(&self) -> Option<f64> {
        self.mean(|score| score.amotp_m)
    }
}

impl ClassScore {
    /// At the best threshold: not below 0.
    pub fn mota(&self) -> f64 {
        self.best.as_ref().map_or(0.0, clipped_mota)
    }

    /// At the best threshold.
    pub fn motar(&self) -> f64 {
        self.best.as_ref().map_or(0.0, motar)
    }

    /// At the best threshold, m.
    pub fn motp_m(&self) -> f64 {
        self.best.as_ref().map_or(WORST_MOTP_M, motp_m)
    }

    /// At the best threshold.
    pub fn recall(&self) -> f64 {
        self.best.and_then(|clear| clear.recall()).unwrap_or(0.0)
    }
}

/// `None` if the class has no true boxes.
#[expect(clippy::cast_precision_loss, reason = "40 recalls")]
fn class_score(scenes: &[Filled], class: TrackingClass) -> Option<ClassScore> {
    let scenes: Vec<Indexed> = scenes.iter().map(|scene| scene.indexed(class, GATE_M)).collect();
    let objects: u64 = scenes.iter().map(Indexed::n_true).sum();
    if objects == 0 {
        return None;
    }
    let thresholds = score_thresholds(matched_scores(&scenes), objects);
    let counts = counts_at(&scenes, &thresholds);
    let (mut motar_sum, mut motp_sum, mut best) = (0.0, 0.0, None::<Clear>);
    for clear in counts {
        motar_sum += clear.as_ref().map_or(0.0, motar);
        motp_sum += clear.as_ref().map_or(WORST_MOTP_M, motp_m);
        // The first of equal ones has the highest recall.
        let mota = |clear: &Option<Clear>| clear.as_ref().map(clipped_mota);
        if mota(&clear) > mota(&best) {
            best = clear;
        }
    }
    let n_recalls = N_RECALLS as f64;
    Some(ClassScore { amota: motar_sum / n_recalls, amotp_m: motp_sum / n_recalls, objects, best })
}

/// CLEAR MOT at each threshold.
fn counts_at(scenes: &[Indexed], thresholds: &[Option<f64>; N_RECALLS]) -> [Option<Clear>; N_RECALLS] {
    let mut counts = thresholds.map(|threshold| threshold.map(|_| Clear::default()));
    for scene in scenes {
        let mut last: Option<(f64, Clear)> = None;
        for (sum, threshold) in counts.iter_mut().zip(thresholds) {
            let (Some(sum), Some(threshold)) = (sum, threshold) else { continue };
            // Neighbouring recalls often have the same threshold.
            let clear = match last {
                Some((same, clear)) if same == *threshold => clear,
                _ => correspond(scene, GATE_M, *threshold, |_| ()),
            };
            last = Some((*threshold, clear));
            sum.merge(&clear);
        }
    }
    counts
}

/// The scores of boxes that are matched without a threshold. Switches are left out, as in the devkit.
fn matched_scores(scenes: &[Indexed]) -> Vec<f64> {
    let mut scores = vec![];
    for scene in scenes {
        let mut instants = scene.instants.iter().peekable();
        correspond(scene, GATE_M, f64::NEG_INFINITY, |pair| {
            while instants.next_if(|instant| instant.number < pair.instant).is_some() {}
            if let Some(instant) = instants.peek().filter(|_| !pair.is_switch) {
                scores.push(instant.reported[pair.reported].score);
            }
        });
    }
    scores
}

fn clipped_mota(clear: &Clear) -> f64 {
    clear.mota().unwrap_or(0.0).max(0.0)
}

fn motp_m(clear: &Clear) -> f64 {
    clear.motp_m().unwrap_or(WORST_MOTP_M)
}

/// MOTA relative to the recall r of matches, not below 0: max(0, 1 − (IDS + FP + FN − (1 − r) P) / (r P)). (1 − r) P is
/// FN + IDS, so that only false positives are left.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
fn motar(clear: &Clear) -> f64 {
    if clear.matches() == 0 {
        return 0.0;
    }
    (1.0 - clear.false_positives as f64 / clear.matches() as f64).max(0.0)
}

#[cfg(test)]
mod tests;
