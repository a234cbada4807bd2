//! The built-in distributions as values.

use super::draws::standard_normal;
use rand::Rng;
use rand::distr::Distribution;

/// The normal distribution of mean 0 and variance 1, with the same bits on every machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StandardNormal;

impl Distribution<f64> for StandardNormal {
    fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> f64 {
        standard_normal(rng)
    }
}
