//! Ratios of means with an interval: a paired bootstrap over parts that were computed on common random numbers.

use crate::protocol::noise::{Purpose, Realisation};
use rand::RngExt;

const RESAMPLES: usize = 2000;

/// A ratio of means, with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ratio {
    pub(crate) ratio: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Sum and number of what two methods are compared by, in one part (a scene, a stretch of time).
pub(crate) type Pair = [(f64, f64); 2];

/// The ratio of the first one's mean to the second one's, over all parts.
pub(crate) fn bootstrap(pairs: &[Pair], seed: u64) -> Ratio {
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
    // Parts without any object of the subset may be all that is drawn.
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
    fn equal_parts_leave_no_doubt_and_different_ones_do() {
        let sure = bootstrap(&[[(4.0, 2.0), (1.0, 1.0)]; 5], 1);
        assert_eq!(sure, Ratio { ratio: 2.0, low: 2.0, high: 2.0 });
        let unsure = bootstrap(&[[(2.0, 1.0), (1.0, 1.0)], [(3.0, 1.0), (1.0, 1.0)]], 1);
        assert_eq!(unsure, Ratio { ratio: 2.5, low: 2.0, high: 3.0 });
    }
}
