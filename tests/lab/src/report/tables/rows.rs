//! Rows of the tables.

use crate::data::noise::{NoisePair, Shape};
use crate::drive::keyframes::contender::Contender;
use crate::drive::keyframes::method::Method;
use crate::drive::keyframes::setting::Setting;
use crate::report::tables::kind::Table;
use crate::report::tables::published::{Published, published};
use crate::report::tables::study::Block;
use crate::score::keyframes::counting::{Counting, Subset};
use crate::score::keyframes::experiments::{Plan, Scores};
use crate::score::keyframes::method_score::{ClassScore, MethodScore};
use crate::score::keyframes::metrics::{Metrics, Value, values};
use crate::score::keyframes::trackers::TrackerScore;
use crate::score::moments::Moments;
use crate::score::tracking::nees::Consistency;
use serde::Serialize;
use v2x_common::class::Class;

impl Nees {
    fn of(consistency: &Consistency) -> Self {
        Self {
            nees_position: consistency.position.mean(),
            nees_yaw: consistency.yaw.mean(),
            nees_size: consistency.size.mean(),
        }
    }
}

/// One row of `--json`. Precision and recall are fractions; `_std` is over frames, `_trial_std` over trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Row {
    /// The table.
    pub table: Table,
    /// Levels of noise of both agents.
    pub noise: NoisePair,
    /// The shape of the errors.
    pub shape: Shape,
    /// The method.
    pub method: String,
    /// The divisor of the errors.
    pub counting: Counting,
    /// The subset of objects.
    pub subset: Subset,
    /// Only objects of this class.
    pub class: Option<Class>,
    /// The metrics.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Number of trials.
    pub trials: u32,
    /// The method's inputs apart from boxes and classes.
    #[serde(rename = "told")]
    pub inputs: String,
    /// The paper's values.
    #[serde(flatten)]
    pub paper: Published,
    /// 1 − IoU of aligned boxes with those of their objects (nuScenes' ASE).
    pub ase: Option<f64>,
    /// NEES per degree of freedom.
    #[serde(flatten)]
    pub nees: Nees,
    /// Tracking and detection metrics; null of the paper's detectors.
    #[serde(flatten)]
    pub tracker: TrackerScore,
}

/// NEES per degree of freedom; 1 is consistent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Nees {
    /// Of the position.
    pub nees_position: Option<f64>,
    /// Of the heading.
    pub nees_yaw: Option<f64>,
    /// Of the size.
    pub nees_size: Option<f64>,
}

/// All rows of a block.
pub(crate) fn rows(block: &Block, plan: &Plan, scores: &Scores) -> Vec<Row> {
    let mut rows = Vec::new();
    for contender in &block.contenders {
        let Some(cell) = plan.cell(block.setting, contender.key()) else { continue };
        let trials: Vec<MethodScore> =
            (0..scores.n_trials()).map(|trial| scores.trial(cell, trial)).collect();
        let blank = blank(block, contender, plan.trials);
        let errors = |counting| Subset::ALL.map(|subset| with_errors(&blank, &trials, counting, subset));
        match block.table {
            Table::Fig3 | Table::Nees => rows.extend(by_class(&blank, &trials)),
            Table::IV => rows.extend(Counting::ALL.into_iter().flat_map(errors)),
            _ => rows.extend(Counting::OF_THE_PAPER.into_iter().flat_map(errors)),
        }
    }
    rows
}

fn blank(block: &Block, contender: &Contender, trials: u32) -> Row {
    let Setting { noise, shape, .. } = block.setting;
    Row {
        table: block.table,
        noise,
        shape,
        method: contender.key().to_owned(),
        counting: Counting::Table,
        subset: Subset::All,
        class: None,
        metrics: Metrics::default(),
        trials,
        inputs: contender.inputs(),
        paper: Published::default(),
        ase: None,
        nees: Nees::default(),
        tracker: TrackerScore::default(),
    }
}

fn with_errors(blank: &Row, trials: &[MethodScore], counting: Counting, subset: Subset) -> Row {
    let by_trial: Vec<[Moments; 5]> = trials.iter().map(|score| score.of(subset).metrics(counting)).collect();
    let mut scale = Moments::default();
    trials.iter().for_each(|score| scale.merge(&score.scale()));
    let ase = scale.mean().filter(|_| subset == Subset::All);
    Row { counting, subset, metrics: Metrics(values(&by_trial)), ase, ..blank.clone() }.beside_the_paper()
}

/// A row for each class.
fn by_class(blank: &Row, trials: &[MethodScore]) -> Vec<Row> {
    let mut classes: Vec<Class> = trials.iter().flat_map(MethodScore::classes).map(|one| one.class).collect();
    classes.sort_unstable();
    classes.dedup();
    let row = |class: Class| {
        let of_class = |score: &MethodScore| score.classes().iter().find(|one| one.class == class).copied();
        let found: Vec<ClassScore> = trials.iter().filter_map(of_class).collect();
        let errors: Vec<[Moments; 3]> = found.iter().map(|one| one.errors).collect();
        let [ate, ade, aoe] = values(&errors);
        let (mut scale, mut consistency) = (Moments::default(), Consistency::default());
        for one in &found {
            scale.merge(&one.scale);
            consistency.merge(&one.consistency);
        }
        Row {
            class: Some(class),
            metrics: Metrics([ate, ade, aoe, Value::default(), Value::default()]),
            ase: scale.mean(),
            nees: Nees::of(&consistency),
            ..blank.clone()
        }
    };
    classes.into_iter().map(row).collect()
}

impl Row {
    /// Adds the paper's values.
    fn beside_the_paper(self) -> Self {
        // The paper has no subsets.
        let is_comparable = self.subset == Subset::All && self.shape == Shape::Gaussian;
        let method = Method::ALL.iter().find(|method| method.key() == self.method);
        let paper = method.filter(|_| is_comparable);
        let paper = paper.and_then(|method| published(self.table, self.noise, *method, self.counting));
        Self { paper: paper.unwrap_or_default(), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_in_json_has_flat_names() {
        let value = Value { mean: Some(0.5), std: Some(0.1), trial_std: None };
        let row = Row {
            table: Table::II,
            noise: NoisePair::N1N3,
            shape: Shape::Gaussian,
            method: "csba-wls".to_owned(),
            counting: Counting::Table,
            subset: Subset::Moving,
            class: None,
            metrics: Metrics([value; 5]),
            trials: 1,
            inputs: "σ".to_owned(),
            paper: Published::default(),
            ase: None,
            nees: Nees::default(),
            tracker: TrackerScore::default(),
        };
        let json = serde_json::to_value(&row).unwrap();
        assert_eq!((&json["table"], &json["noise"]), (&"II".into(), &"N1-N3".into()));
        assert_eq!(serde_json::to_value(Table::Fig3).unwrap(), "fig3");
        assert_eq!(json["method"], "csba-wls");
        assert_eq!((&json["counting"], &json["subset"]), (&"table".into(), &"moving".into()));
        assert_eq!((json["mate_m"].as_f64(), json["recall_std"].as_f64()), (Some(0.5), Some(0.1)));
        assert!(json["maoe_deg_trial_std"].is_null());
    }
}
