//! Mean errors over frames and trials, as the tables name them.

use crate::score::moments::Moments;
use serde::Serialize;

/// The mean of a metric, with standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// Mean over frames; `None` without data.
    pub mean: Option<f64>,
    /// Standard deviation over frames: the paper's ±.
    pub std: Option<f64>,
    /// Standard deviation over the means of the trials.
    pub trial_std: Option<f64>,
}

/// mATE (m), mADE (m), mAOE (degrees), precision and recall (fractions).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Metrics(pub [Value; 5]);

const NAMES: [[&str; 3]; 5] = [
    ["mate_m", "mate_m_std", "mate_m_trial_std"],
    ["made_m", "made_m_std", "made_m_trial_std"],
    ["maoe_deg", "maoe_deg_std", "maoe_deg_trial_std"],
    ["precision", "precision_std", "precision_trial_std"],
    ["recall", "recall_std", "recall_trial_std"],
];

impl Metrics {
    /// Every number with its name.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, Option<f64>)> {
        let values = self.0.map(|value| [value.mean, value.std, value.trial_std]);
        NAMES.into_iter().flatten().zip(values.into_iter().flatten())
    }
}

impl Serialize for Metrics {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.named())
    }
}

/// Means and deviations of moments by trial.
pub(crate) fn values<const N: usize>(by_trial: &[[Moments; N]]) -> [Value; N] {
    std::array::from_fn(|metric| {
        let mut total = Moments::default();
        by_trial.iter().for_each(|trial| total.merge(&trial[metric]));
        let means: Moments = by_trial.iter().filter_map(|trial| trial[metric].mean()).collect();
        Value { mean: total.mean(), std: total.standard_deviation(), trial_std: means.standard_deviation() }
    })
}
