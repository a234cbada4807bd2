//! A distribution of errors, chosen when the program runs.

use rand::distr::Distribution;
use rand_chacha::ChaCha8Rng;
use std::fmt;
use std::sync::Arc;

/// Any distribution of numbers, such as those of `rand_distr`. Cloning shares it.
#[derive(Clone)]
pub(super) struct NoiseLaw(Arc<dyn Draw + Send + Sync>);

/// [`Distribution`] with the random number generator fixed, so that it can be a trait object.
trait Draw {
    fn draw(&self, rng: &mut ChaCha8Rng) -> f64;
}

impl<D: Distribution<f64>> Draw for D {
    fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        self.sample(rng)
    }
}

impl NoiseLaw {
    /// The law of this distribution.
    pub(super) fn new(distribution: impl Distribution<f64> + Send + Sync + 'static) -> Self {
        Self(Arc::new(distribution))
    }

    /// One number from the law. It may be anything that the distribution gives, also not finite.
    pub(super) fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        self.0.draw(rng)
    }
}

impl fmt::Debug for NoiseLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("NoiseLaw")
    }
}
