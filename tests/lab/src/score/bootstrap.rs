//! Ratios of means with an interval: a paired bootstrap over parts that were computed on common random numbers.

use crate::data::noise::{Purpose, Realisation};
use rand::RngExt;

const RESAMPLES: usize = 2000;

/// A ratio of means, with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ratio {
    pub(crate) ratio: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// Sum and number of the compared errors of two methods, in one part (a scene, a stretch of time).
pub(crate) type Pair = [(f64, f64); 2];

/// The ratio of the first mean to the second, over all parts of all groups. Parts of one group (stretches of one run)
/// share their world: groups are drawn first, then parts of each.
pub(crate) fn bootstrap(groups: &[Vec<Pair>], seed: u64) -> Ratio {
    let ratio = |parts: &mut dyn Iterator<Item = Pair>| {
        let mut sums = [(0.0, 0.0); 2];
        for part in parts {
            for (sum, (value, n)) in sums.iter_mut().zip(part) {
                *sum = (sum.0 + value, sum.1 + n);
            }
        }
        let [worse, better] = sums.map(|(value, n)| value / n);
        worse / better
    };
    let mut rng = Realisation { seed, trial: 0 }.rng("bootstrap", 0, Purpose::Place);
    let mut drawn: Vec<Pair> = Vec::new();
    let resample = |_| {
        drawn.clear();
        for _ in groups {
            let group = &groups[rng.random_range(0..groups.len())];
            match group[..] {
                [only] => drawn.push(only),
                _ => drawn.extend((0..group.len()).map(|_| group[rng.random_range(0..group.len())])),
            }
        }
        ratio(&mut drawn.iter().copied())
    };
    // A resample may have no object of the subset.
    let mut resampled: Vec<f64> = (0..RESAMPLES).map(resample).filter(|ratio| ratio.is_finite()).collect();
    resampled.sort_unstable_by(f64::total_cmp);
    let ratio = ratio(&mut groups.iter().flatten().copied());
    let cut = resampled.len() / 40;
    let quantile =
        |place: Option<usize>| place.and_then(|place| resampled.get(place)).copied().unwrap_or(ratio);
    Ratio { ratio, low: quantile(Some(cut)), high: quantile((resampled.len()).checked_sub(1 + cut)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_parts_have_an_interval_of_width_zero_and_different_ones_do_not() {
        let sure = bootstrap(&vec![vec![[(4.0, 2.0), (1.0, 1.0)]]; 5], 1);
        assert_eq!(sure, Ratio { ratio: 2.0, low: 2.0, high: 2.0 });
        let unsure = bootstrap(&[vec![[(2.0, 1.0), (1.0, 1.0)]], vec![[(3.0, 1.0), (1.0, 1.0)]]], 1);
        assert_eq!(unsure, Ratio { ratio: 2.5, low: 2.0, high: 3.0 });
    }

    #[test]
    fn many_parts_of_few_groups_are_not_taken_for_many_groups() {
        let part = |worse: f64| [(worse, 1.0), (1.0, 1.0)];
        let grouped = bootstrap(&[vec![part(2.0); 50], vec![part(3.0); 50]], 1);
        assert_eq!((grouped.low, grouped.high), (2.0, 3.0));
        let single: Vec<_> =
            [vec![part(2.0); 50], vec![part(3.0); 50]].concat().into_iter().map(|p| vec![p]).collect();
        let single = bootstrap(&single, 1);
        assert!(single.low > 2.2 && single.high < 2.8);
    }
}
