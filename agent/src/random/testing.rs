//! Samples compared with those of `rand_distr`.

use super::keyed::{Purpose, keyed_rng};
use rand::distr::Distribution;
use rand_chacha::ChaCha8Rng;

const N_DRAWS: usize = 100_000;
/// Of the two-sample Kolmogorov-Smirnov statistic of 100 000 draws each: √(−ln(α/2) / N) with α = 10⁻⁶. A correct sampler
/// fails for one in a million seeds (the seed is fixed).
const LIMIT: f64 = 0.012_05;

/// Checks that draws of ours have the distribution of the oracle.
#[track_caller]
pub(crate) fn assert_same_distribution(
    mut ours: impl FnMut(&mut ChaCha8Rng) -> f64,
    oracle: &impl Distribution<f64>,
) {
    let mut rng = keyed_rng(11, None, 0, Purpose::Clutter);
    let mut one: Vec<f64> = (0..N_DRAWS).map(|_| ours(&mut rng)).collect();
    let mut rng = keyed_rng(11, None, 1, Purpose::Clutter);
    let mut other: Vec<f64> = (0..N_DRAWS).map(|_| oracle.sample(&mut rng)).collect();
    let statistic = kolmogorov_smirnov(&mut one, &mut other);
    assert!(statistic < LIMIT, "{statistic}");
}

/// The largest difference between the two empirical distribution functions.
fn kolmogorov_smirnov(one: &mut [f64], other: &mut [f64]) -> f64 {
    one.sort_unstable_by(f64::total_cmp);
    other.sort_unstable_by(f64::total_cmp);
    let share_up_to = |draws: &[f64], x: f64| draws.partition_point(|y| *y <= x) as f64 / draws.len() as f64;
    let at = |x: &f64| (share_up_to(one, *x) - share_up_to(other, *x)).abs();
    one.iter().chain(other.iter()).map(at).fold(0.0, f64::max)
}

#[test]
fn the_comparison_detects_a_standard_deviation_that_is_wrong_by_5_percent() {
    let draws = |sigma: f64| {
        let mut rng = keyed_rng(11, None, 2, Purpose::Clutter);
        (0..N_DRAWS).map(|_| sigma * super::standard_normal(&mut rng)).collect::<Vec<f64>>()
    };
    let mut right: Vec<f64> = draws(1.0).into_iter().map(|x| -x).collect();
    assert!(kolmogorov_smirnov(&mut right, &mut draws(1.05)) > LIMIT);
}
