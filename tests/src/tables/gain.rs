//! By how much one method beats another, with an interval.

use super::Tables;
use crate::protocol::counting::{Counting, Subset};
use crate::protocol::moments::Moments;
use crate::protocol::noise::{Purpose, Realisation};
use crate::protocol::run::{Cell, Setting};
use rand::RngExt;

const RESAMPLES: usize = 2000;

/// A ratio of means, with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ratio {
    pub(super) ratio: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Mean and number of frames of two methods in one scene, all trials together.
type Pair = [(f64, f64); 2];

/// mATE, mADE and mAOE of `worse` over those of `better`, counted as the paper's tables are, with the interval of a
/// paired bootstrap over scenes on common random numbers; `None` where a method was not computed.
pub(super) fn gains(
    tables: &Tables,
    setting: Setting,
    (worse, better): (&str, &str),
    subset: Subset,
) -> Option<[Ratio; 3]> {
    let cells = [tables.plan.cell(setting, worse)?, tables.plan.cell(setting, better)?];
    let ratios = std::array::from_fn(|metric| {
        let pairs: Vec<Pair> = (0..tables.scores.n_scenes())
            .map(|scene| cells.map(|cell| totals(tables, cell, (scene, subset), metric)))
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

fn bootstrap(pairs: &[Pair], seed: u64) -> Ratio {
    let ratio = |places: &mut dyn Iterator<Item = usize>| {
        let mut sums = [(0.0, 0.0); 2];
        for place in places {
            for (sum, (value, n)) in sums.iter_mut().zip(pairs[place]) {
                *sum = (sum.0 + value, sum.1 + n);
            }
        }
        let [worse, better] = sums.map(|(value, n)| value / n);
        worse / better
    };
    let mut rng = Realisation { seed, trial: 0 }.rng("bootstrap", 0, Purpose::Place);
    let resample = |_| ratio(&mut (0..pairs.len()).map(|_| rng.random_range(0..pairs.len())));
    // Scenes without any object of the subset may be all that is drawn.
    let mut resampled: Vec<f64> = (0..RESAMPLES).map(resample).filter(|ratio| ratio.is_finite()).collect();
    resampled.sort_unstable_by(f64::total_cmp);
    let ratio = ratio(&mut (0..pairs.len()));
    let cut = resampled.len() / 40;
    let quantile =
        |place: Option<usize>| place.and_then(|place| resampled.get(place)).copied().unwrap_or(ratio);
    Ratio { ratio, low: quantile(Some(cut)), high: quantile((resampled.len()).checked_sub(1 + cut)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_scenes_leave_no_doubt_and_different_ones_do() {
        let sure = bootstrap(&[[(4.0, 2.0), (1.0, 1.0)]; 5], 1);
        assert_eq!(sure, Ratio { ratio: 2.0, low: 2.0, high: 2.0 });
        let unsure = bootstrap(&[[(2.0, 1.0), (1.0, 1.0)], [(3.0, 1.0), (1.0, 1.0)]], 1);
        assert_eq!(unsure, Ratio { ratio: 2.5, low: 2.0, high: 3.0 });
    }
}
