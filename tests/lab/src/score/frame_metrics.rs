//! The last step for runs and logs: the figures of one frame, and their means over frames.
//!
//! Every figure is computed per frame over the pairs of that frame, and then averaged over the frames that have it. A
//! frame without a pair has no error, a frame without an object has no recall.

use crate::score::errors::{SizeNorm, half_nees};
use crate::score::frame_errors::{ErrorSums, FrameErrors};
use crate::score::gospa::{GospaParts, gospa};
use crate::score::matching::{Frame, Matching, Outcome};
use crate::score::moments::Moments;
use serde::{Deserialize, Serialize};
use v2x_fusion_hub::association::assignment::Assigner;

/// The figures of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrameMetrics {
    /// Errors and counts.
    pub sums: ErrorSums,
    /// Mean of `eᵀ S⁻¹ e / 2` over the matched boxes' positions; 1 where the reported S is right.
    pub nees_position: Option<f64>,
    /// Squared GOSPA by cause.
    pub gospa: GospaParts,
}

impl FrameMetrics {
    /// Mean distance of the matched boxes' centres from the truth, m.
    pub(crate) fn ate_m(&self) -> Option<f64> {
        self.sums.mean_of_matched().map(|[ate_m, ..]| ate_m)
    }
}

/// The figures of one matched frame; GOSPA is cut off at `cutoff_m`.
pub(crate) fn frame_metrics(
    frame: &Frame<'_>,
    matching: &Matching,
    cutoff_m: f64,
    assigner: &mut Assigner,
) -> FrameMetrics {
    let sums = FrameErrors::of(frame, matching, SizeNorm::Hypot).sums(|_| true);
    let (mut estimates, mut objects) = (Vec::new(), Vec::new());
    for (estimate, outcome) in frame.estimates.iter().zip(&matching.outcomes) {
        if let Outcome::Matched(place) = *outcome {
            objects.push(frame.truth[place].bev);
        }
        if *outcome != Outcome::Ignored {
            estimates.push(estimate.bev);
        }
    }
    objects.extend(matching.missed.iter().map(|place| frame.truth[*place].bev));
    let nees_position = mean_half_nees(frame, matching);
    FrameMetrics { sums, nees_position, gospa: gospa(&estimates, &objects, cutoff_m, assigner) }
}

/// Mean of `eᵀ S⁻¹ e / 2` over the matched boxes' positions: the NEES/2 of every report. Boxes are to be matched by position:
/// by provenance a box far from its object, as after a wrong association, would count by the square of that distance.
pub(crate) fn mean_half_nees(frame: &Frame<'_>, matching: &Matching) -> Option<f64> {
    let mut nees = Moments::default();
    for (estimate, outcome) in frame.estimates.iter().zip(&matching.outcomes) {
        if let Outcome::Matched(place) = *outcome {
            nees.add(half_nees(estimate, &frame.truth[place].bev));
        }
    }
    nees.mean()
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
    /// True positives among the estimates that count, 0 to 1.
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
    /// Scored frames.
    pub frames: u64,
}

/// Gathers frames into [`Metrics`].
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tally {
    /// Translation (m), dimension (m), orientation (degrees).
    errors: [Moments; 3],
    precision: Moments,
    recall: Moments,
    gospa: Moments,
    gospa_parts: [Moments; 3],
    nees: Moments,
    counts: ErrorSums,
    frames: u64,
}

impl Tally {
    /// Adds a frame.
    pub(crate) fn add(&mut self, frame: &FrameMetrics) {
        let FrameMetrics { sums, nees_position, gospa } = frame;
        let means = sums.mean_of_matched();
        for (axis, moments) in self.errors.iter_mut().enumerate() {
            moments.add(means.map(|means| means[axis]));
        }
        let (precision, recall) = (sums.precision(), sums.recall());
        self.precision.add(precision);
        self.recall.add(recall);
        self.nees.add(*nees_position);
        self.counts.true_positives += sums.true_positives;
        self.counts.false_positives += sums.false_positives;
        self.counts.missed += sums.missed;
        self.frames += 1;
        // A frame with neither objects nor estimates has no GOSPA, not a perfect one.
        if precision.is_some() || recall.is_some() {
            let GospaParts { localisation_m2, missed_m2, false_m2 } = *gospa;
            self.gospa.add(Some(gospa.distance_m()));
            for (moments, part) in self.gospa_parts.iter_mut().zip([localisation_m2, missed_m2, false_m2]) {
                moments.add(Some(part));
            }
        }
    }

    /// The means so far.
    pub(crate) fn metrics(&self) -> Metrics {
        let [localisation, missed, false_] = self.gospa_parts.map(|part| part.mean());
        let [ate_m, ade_m, aoe_deg] = self.errors.map(|error| error.mean());
        let parts = localisation.zip(missed).zip(false_);
        Metrics {
            ate_m,
            ade_m,
            aoe_deg,
            precision: self.precision.mean(),
            recall: self.recall.mean(),
            gospa_m: self.gospa.mean(),
            gospa_parts: parts.map(|((localisation_m2, missed_m2), false_m2)| GospaParts {
                localisation_m2,
                missed_m2,
                false_m2,
            }),
            nees_position: self.nees.mean(),
            true_positives: self.counts.true_positives,
            false_positives: self.counts.false_positives,
            false_negatives: self.counts.missed,
            frames: self.frames,
        }
    }
}

#[cfg(test)]
mod tests;
