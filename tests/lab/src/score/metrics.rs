//! How good the predictions of one frame are, and the means over frames.
//!
//! Every figure is computed per frame over the pairs of that frame and then averaged over the frames
//! that have it: a frame without a pair has no error, a frame without an object no recall.

use crate::score::gospa::{GospaParts, gospa};
use crate::score::matching::{Matching, Outcome, distance_m};
use serde::{Deserialize, Serialize};
use v2x_agent::truth::TrueObject;
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::{BevBox, angle_difference};
use v2x_fusion_hub::assignment::Assigner;

/// What somebody says of one object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Where, how large, and which way.
    pub bev: BevBox,
    /// What it says of the error of its position, m².
    pub position: Covariance2,
}

/// The figures of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMetrics {
    /// Mean distance of the matched boxes' centres from the truth, m.
    pub ate_m: Option<f64>,
    /// Mean error of the matched boxes' dimensions, sqrt(Δw² + Δd²), m.
    pub ade_m: Option<f64>,
    /// Mean error of the matched boxes' headings, degrees, 0 to 180.
    pub aoe_deg: Option<f64>,
    /// Mean of `eᵀ S⁻¹ e / 2` over the matched boxes' positions; 1 where the reported S is right.
    pub nees_position: Option<f64>,
    /// Squared GOSPA by cause.
    pub gospa: GospaParts,
    /// Predictions of objects that count.
    pub true_positives: u64,
    /// Predictions of nothing.
    pub false_positives: u64,
    /// Objects that count and that nobody predicted.
    pub false_negatives: u64,
}

/// Judges one frame; GOSPA is cut off at `cutoff_m`.
pub fn frame_metrics(
    predictions: &[Prediction],
    truth: &[TrueObject],
    matching: &Matching,
    cutoff_m: f64,
    assigner: &mut Assigner,
) -> FrameMetrics {
    let (mut ate, mut ade, mut aoe, mut nees) =
        (Mean::default(), Mean::default(), Mean::default(), Mean::default());
    let (mut judged, mut objects) = (Vec::new(), Vec::new());
    let mut false_positives = 0;
    for (prediction, outcome) in predictions.iter().zip(&matching.outcomes) {
        match *outcome {
            Outcome::Ignored => continue,
            Outcome::False => false_positives += 1,
            Outcome::Matched(place) => {
                let (says, is) = (&prediction.bev, &truth[place].bev);
                ate.add(Some(distance_m(says, is)));
                ade.add(Some(libm::hypot(says.w - is.w, says.d - is.d)));
                aoe.add(Some(angle_difference(says.yaw, is.yaw).abs().to_degrees()));
                nees.add(half_nees(prediction, is));
                objects.push(*is);
            }
        }
        judged.push(prediction.bev);
    }
    let true_positives = objects.len() as u64;
    objects.extend(matching.missed.iter().map(|place| truth[*place].bev));
    FrameMetrics {
        ate_m: ate.value(),
        ade_m: ade.value(),
        aoe_deg: aoe.value(),
        nees_position: nees.value(),
        gospa: gospa(&judged, &objects, cutoff_m, assigner),
        true_positives,
        false_positives,
        false_negatives: matching.missed.len() as u64,
    }
}

/// `eᵀ S⁻¹ e / 2` of the position; `None` where S is no covariance.
pub(crate) fn half_nees(prediction: &Prediction, is: &BevBox) -> Option<f64> {
    let s = &prediction.position;
    if !s.is_valid() {
        return None;
    }
    let (dx, dy) = (prediction.bev.x - is.x, prediction.bev.y - is.y);
    Some((s.yy * dx * dx - 2.0 * s.xy * dx * dy + s.xx * dy * dy) / s.determinant() / 2.0)
}

impl FrameMetrics {
    /// Share of predictions that are of a real object; `None` without predictions.
    pub fn precision(&self) -> Option<f64> {
        share(self.true_positives, self.false_positives)
    }

    /// Share of objects that are predicted; `None` without objects.
    pub fn recall(&self) -> Option<f64> {
        share(self.true_positives, self.false_negatives)
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts of objects")]
fn share(hits: u64, others: u64) -> Option<f64> {
    (hits + others > 0).then(|| hits as f64 / (hits + others) as f64)
}

/// Means over frames. A figure without data is `None` (null in JSON), never 0 or NaN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Average translation error, m.
    pub ate_m: Option<f64>,
    /// Average dimension error, m.
    pub ade_m: Option<f64>,
    /// Average orientation error, degrees.
    pub aoe_deg: Option<f64>,
    /// True positives among the predictions that count, 0 to 1.
    pub precision: Option<f64>,
    /// True positives among the objects that count, 0 to 1.
    pub recall: Option<f64>,
    /// Mean GOSPA (p = 2, α = 2, cut-off = match radius), m.
    pub gospa_m: Option<f64>,
    /// Mean squared GOSPA by cause, m².
    pub gospa_parts: Option<GospaParts>,
    /// Mean position NEES over its 2 degrees of freedom: 1 is consistent, more is overconfident.
    pub nees_position: Option<f64>,
    /// Pooled over all frames.
    pub true_positives: u64,
    /// Pooled over all frames.
    pub false_positives: u64,
    /// Pooled over all frames.
    pub false_negatives: u64,
    /// Frames judged.
    pub frames: u64,
}

/// Gathers frames into [`Metrics`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    ate: Mean,
    ade: Mean,
    aoe: Mean,
    precision: Mean,
    recall: Mean,
    gospa: Mean,
    gospa_parts: [Mean; 3],
    nees: Mean,
    counts: [u64; 3],
    frames: u64,
}

impl Tally {
    /// Takes in one frame.
    pub fn add(&mut self, frame: &FrameMetrics) {
        self.ate.add(frame.ate_m);
        self.ade.add(frame.ade_m);
        self.aoe.add(frame.aoe_deg);
        self.precision.add(frame.precision());
        self.recall.add(frame.recall());
        self.nees.add(frame.nees_position);
        self.counts[0] += frame.true_positives;
        self.counts[1] += frame.false_positives;
        self.counts[2] += frame.false_negatives;
        self.frames += 1;
        // A frame with neither objects nor predictions says nothing, not that all is perfect.
        if frame.precision().is_some() || frame.recall().is_some() {
            let GospaParts { localisation_m2, missed_m2, false_m2 } = frame.gospa;
            self.gospa.add(Some(frame.gospa.distance_m()));
            for (mean, part) in self.gospa_parts.iter_mut().zip([localisation_m2, missed_m2, false_m2]) {
                mean.add(Some(part));
            }
        }
    }

    /// The means so far.
    pub fn metrics(&self) -> Metrics {
        let [localisation, missed, false_] = self.gospa_parts.map(|mean| mean.value());
        let parts = localisation.zip(missed).zip(false_);
        Metrics {
            ate_m: self.ate.value(),
            ade_m: self.ade.value(),
            aoe_deg: self.aoe.value(),
            precision: self.precision.value(),
            recall: self.recall.value(),
            gospa_m: self.gospa.value(),
            gospa_parts: parts.map(|((localisation_m2, missed_m2), false_m2)| GospaParts {
                localisation_m2,
                missed_m2,
                false_m2,
            }),
            nees_position: self.nees.value(),
            true_positives: self.counts[0],
            false_positives: self.counts[1],
            false_negatives: self.counts[2],
            frames: self.frames,
        }
    }
}

/// A mean of what there is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    sum: f64,
    count: u32,
}

impl Mean {
    /// Takes in one value, if there is one.
    pub fn add(&mut self, value: Option<f64>) {
        if let Some(value) = value {
            self.sum += value;
            self.count += 1;
        }
    }

    /// The mean; `None` of nothing.
    pub fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / f64::from(self.count))
    }
}

#[cfg(test)]
mod tests;
