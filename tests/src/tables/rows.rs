//! Rows of the tables.

use crate::protocol::counting::{Counting, Score, Subset};
use crate::protocol::method::Method;
use crate::protocol::moments::Moments;
use crate::protocol::noise::NoisePair;
use crate::protocol::run::{Plan, Scores};
use serde::Serialize;

/// The mean of a metric, and how it varies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// Over frames; `None` where there was nothing to measure.
    pub mean: Option<f64>,
    /// Standard deviation over frames: the paper's ±.
    pub std: Option<f64>,
    /// Standard deviation over the means of the trials.
    pub trial_std: Option<f64>,
}

/// One row of `--json`. Precision and recall are fractions; `_std` is over frames, `_trial_std` over trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Of which of the paper's tables.
    pub table: &'static str,
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// Which method.
    pub method: Method,
    /// What the errors are divided by.
    pub counting: Counting,
    /// Which objects.
    pub subset: Subset,
    /// The metrics.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Number of trials.
    pub trials: u32,
    /// What the method is given apart from boxes and classes.
    pub told: String,
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

/// All rows of Table II, by noise, method, counting and subset.
pub fn rows(plan: &Plan, scores: &Scores) -> Vec<Row> {
    let mut rows = Vec::new();
    for (noise_place, noise) in plan.noise.iter().enumerate() {
        for (method_place, method) in plan.methods.iter().enumerate() {
            let trials: Vec<Score> = (0..scores.n_trials())
                .map(|trial| scores.trial((noise_place, method_place), trial))
                .collect();
            for counting in Counting::ALL {
                for subset in Subset::ALL {
                    rows.push(Row {
                        table: "II",
                        noise: *noise,
                        method: *method,
                        counting,
                        subset,
                        metrics: metrics(&trials, counting, subset),
                        trials: plan.trials,
                        told: method.told(),
                    });
                }
            }
        }
    }
    rows
}

fn metrics(trials: &[Score], counting: Counting, subset: Subset) -> Metrics {
    let by_trial: Vec<[Moments; 5]> = trials.iter().map(|score| score.of(subset).metrics(counting)).collect();
    Metrics(std::array::from_fn(|metric| {
        let mut total = Moments::default();
        by_trial.iter().for_each(|trial| total.merge(&trial[metric]));
        let means: Moments = by_trial.iter().filter_map(|trial| trial[metric].mean()).collect();
        Value { mean: total.mean(), std: total.standard_deviation(), trial_std: means.standard_deviation() }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_in_json_has_flat_names() {
        let value = Value { mean: Some(0.5), std: Some(0.1), trial_std: None };
        let row = Row {
            table: "II",
            noise: NoisePair::N1N3,
            method: Method::CsbaWls,
            counting: Counting::Table,
            subset: Subset::Moving,
            metrics: Metrics([value; 5]),
            trials: 1,
            told: "σ".to_owned(),
        };
        let json = serde_json::to_value(&row).unwrap();
        assert_eq!(json["noise"], "N1-N3");
        assert_eq!(json["method"], "csba-wls");
        assert_eq!((&json["counting"], &json["subset"]), (&"table".into(), &"moving".into()));
        assert_eq!((json["mate_m"].as_f64(), json["recall_std"].as_f64()), (Some(0.5), Some(0.1)));
        assert!(json["maoe_deg_trial_std"].is_null());
    }
}
