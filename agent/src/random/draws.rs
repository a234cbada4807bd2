//! Draws from distributions.

use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// A number in [0, 1).
pub fn unit<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    rng.random::<f64>()
}

/// A number in [`low`, `high`).
pub fn uniform<R: Rng + ?Sized>(rng: &mut R, low: f64, high: f64) -> f64 {
    low + (high - low) * unit(rng)
}

/// True with the given probability.
pub fn chance<R: Rng + ?Sized>(rng: &mut R, probability: f64) -> bool {
    unit(rng) < probability
}

/// A draw from the standard normal distribution (Box-Muller, one of the pair).
pub fn standard_normal<R: Rng + ?Sized>(rng: &mut R) -> f64 {
    let (u, v) = (1.0 - unit(rng), unit(rng));
    libm::sqrt(-2.0 * libm::log(u)) * libm::cos(TAU * v)
}

/// A draw from Normal(`mean`, `sigma`²) given that it lies in [`lower`, `upper`], by rejection.
///
/// `mean` must lie in the interval; then at least about a tenth of the draws are accepted wherever the
/// interval is not far narrower than `sigma`.
pub fn truncated_normal<R: Rng + ?Sized>(
    rng: &mut R,
    mean: f64,
    sigma: f64,
    (lower, upper): (f64, f64),
) -> f64 {
    debug_assert!(lower <= mean && mean <= upper, "{mean} outside of {lower}..{upper}");
    loop {
        let draw = mean + sigma * standard_normal(rng);
        if (lower..=upper).contains(&draw) {
            return draw;
        }
    }
}

/// A draw from the Poisson distribution (Knuth's product of uniforms: for means up to some hundred).
pub fn poisson<R: Rng + ?Sized>(rng: &mut R, mean: f64) -> u32 {
    let limit = libm::exp(-mean);
    let mut count = 0;
    let mut product = 1.0 - unit(rng);
    while product > limit {
        count += 1;
        product *= 1.0 - unit(rng);
    }
    count
}

/// One of the weighted values; the weights need not sum to 1.
///
/// # Panics
/// On an empty list.
pub fn weighted<T: Copy, R: Rng + ?Sized>(rng: &mut R, choices: &[(T, f64)]) -> T {
    let total: f64 = choices.iter().map(|(_, weight)| weight).sum();
    let mut left = unit(rng) * total;
    for (value, weight) in choices {
        left -= weight;
        if left < 0.0 {
            return *value;
        }
    }
    choices.last().expect("a choice needs at least one value").0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::keyed::{Purpose, keyed_rng};
    use crate::random::testing::assert_same_distribution;
    use rand::distr::Distribution;
    use rand_chacha::ChaCha8Rng;

    fn rng() -> ChaCha8Rng {
        keyed_rng(1, None, 0, Purpose::Clutter)
    }

    fn moments(draws: &[f64]) -> (f64, f64) {
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        (mean, draws.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n)
    }

    #[test]
    fn normal_draws_have_mean_0_and_variance_1() {
        let mut rng = rng();
        let draws: Vec<f64> = (0..100_000).map(|_| standard_normal(&mut rng)).collect();
        let (mean, variance) = moments(&draws);
        // Standard errors are 0.003 and 0.0045: four of each.
        assert!(mean.abs() < 0.013 && (variance - 1.0).abs() < 0.018, "{mean} {variance}");
    }

    #[test]
    fn poisson_counts_have_equal_mean_and_variance() {
        for expected in [0.0, 0.5, 20.0] {
            let mut rng = rng();
            let draws: Vec<f64> = (0..50_000).map(|_| f64::from(poisson(&mut rng, expected))).collect();
            let (mean, variance) = moments(&draws);
            // Standard error of the mean at 20 is 0.02, of the variance 0.13.
            assert!((mean - expected).abs() <= 0.005 * expected, "{mean} instead of {expected}");
            assert!((variance - expected).abs() <= 0.03 * expected, "{variance} instead of {expected}");
        }
    }

    #[test]
    fn normal_draws_have_the_distribution_of_rand_distr() {
        assert_same_distribution(standard_normal, &rand_distr::StandardNormal);
    }

    #[test]
    fn truncated_normal_draws_have_the_distribution_of_rand_distr_within_the_bounds() {
        struct Truncated(rand_distr::Normal<f64>);
        impl Distribution<f64> for Truncated {
            fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> f64 {
                let draws = std::iter::repeat_with(|| self.0.sample(rng));
                draws.into_iter().find(|draw| (0.1..=3.0).contains(draw)).expect("the iterator has no end")
            }
        }
        let oracle = Truncated(rand_distr::Normal::new(1.0, 0.8).unwrap());
        assert_same_distribution(|rng| truncated_normal(rng, 1.0, 0.8, (0.1, 3.0)), &oracle);
    }

    #[test]
    fn poisson_draws_have_the_distribution_of_rand_distr() {
        for mean in [0.5, 4.0, 60.0] {
            let oracle = rand_distr::Poisson::new(mean).unwrap();
            assert_same_distribution(|rng| f64::from(poisson(rng, mean)), &oracle);
        }
    }

    #[test]
    fn weights_are_respected() {
        let mut rng = rng();
        let n_heavy = (0..10_000).filter(|_| weighted(&mut rng, &[(true, 3.0), (false, 1.0)])).count();
        assert!((7300..7700).contains(&n_heavy), "{n_heavy}");
    }
}
