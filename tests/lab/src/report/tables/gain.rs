//! Ratios of two methods' errors, with intervals.

use crate::drive::keyframes::setting::Setting;
use crate::report::tables::results::Tables;
use crate::score::bootstrap::{Pair, Ratio, bootstrap};
use crate::score::keyframes::counting::{Counting, Subset};
use crate::score::keyframes::experiments::Cell;
use crate::score::moments::Moments;

/// mATE, mADE and mAOE of `worse` over those of `better`, counted as in the paper's tables, with the interval of a paired
/// bootstrap over scenes on common random numbers; `None` where a method was not computed.
pub(crate) fn gains(
    tables: &Tables,
    setting: Setting,
    (worse, better): (&str, &str),
    subset: Subset,
) -> Option<[Ratio; 3]> {
    let cells = [tables.plan.cell(setting, worse)?, tables.plan.cell(setting, better)?];
    let ratios = std::array::from_fn(|metric| {
        let pairs: Vec<Vec<Pair>> = (0..tables.scores.n_scenes())
            .map(|scene| vec![cells.map(|cell| totals(tables, cell, (scene, subset), metric))])
            .collect();
        bootstrap(&pairs, tables.plan.seed)
    });
    Some(ratios)
}

#[expect(clippy::cast_precision_loss, reason = "numbers of frames")]
fn totals(tables: &Tables, cell: Cell, (scene, subset): (usize, Subset), metric: usize) -> (f64, f64) {
    let mut total = Moments::default();
    for trial in 0..tables.scores.n_trials() {
        let score = tables.scores.scene(cell, trial, scene);
        total.merge(&score.of(subset).metrics(Counting::Table)[metric]);
    }
    (total.sum(), total.n() as f64)
}
