//! Distributions of delays.

use super::trace::Trace;
use crate::random::{standard_normal, truncated_normal, uniform, unit};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;
use v2x_common::time::Span;

/// A distribution of delays, s.
#[derive(Clone, Debug, PartialEq)]
pub enum Delay {
    /// Normal, truncated below at 0.
    Normal {
        /// Mean before truncation.
        mean_s: f64,
        /// Standard deviation before truncation.
        sigma_s: f64,
    },
    /// Uniform.
    Uniform {
        /// Shortest.
        low_s: f64,
        /// Longest.
        high_s: f64,
    },
    /// Log-normal: above 0, with a long tail.
    LogNormal {
        /// Median.
        median_s: f64,
        /// Standard deviation of the logarithm.
        sigma_ln: f64,
    },
    /// Gamma, as in Eclipse MOSAIC's cellular links: min + Gamma(k = 2, θ = 2) · (expected − min) / 4.
    Gamma {
        /// Shortest.
        min_s: f64,
        /// Mean.
        expected_s: f64,
    },
    /// A number of whole frames, Binomial(10, p), as in CoBEVFlow.
    Frames {
        /// Probability of each of ten frames.
        p: f64,
        /// Length of a frame.
        frame_s: f64,
    },
    /// As recorded.
    Trace(Arc<Trace>),
}

/// Number of trials of [`Delay::Frames`].
const MAX_FRAMES: u32 = 10;

impl Delay {
    /// Always the same delay.
    pub const fn constant(delay_s: f64) -> Self {
        Self::Normal { mean_s: delay_s, sigma_s: 0.0 }
    }

    /// One delay, s, of a frame that is sent at `since_start` (since the scenario's start).
    pub fn draw(&self, rng: &mut ChaCha8Rng, since_start: Span) -> f64 {
        match *self {
            Self::Normal { mean_s, sigma_s } => truncated_normal(rng, mean_s, sigma_s, (0.0, f64::INFINITY)),
            Self::Uniform { low_s, high_s } => uniform(rng, low_s, high_s),
            Self::LogNormal { median_s, sigma_ln } => median_s * libm::exp(sigma_ln * standard_normal(rng)),
            Self::Gamma { min_s, expected_s } => {
                // Of k = 2 the sum of two exponentials, each of mean θ = 2.
                let gamma = -2.0 * libm::log((1.0 - unit(rng)) * (1.0 - unit(rng)));
                min_s + gamma * (expected_s - min_s) / 4.0
            }
            Self::Frames { p, frame_s } => {
                let frames = (0..MAX_FRAMES).filter(|_| unit(rng) < p).count();
                frame_s * frames as f64
            }
            Self::Trace(ref trace) => trace.at(since_start).delay_s,
        }
    }

    /// The same with another mean (of the log-normal: median) and standard deviation, where they are given; `None`
    /// where this distribution has no such parameter.
    pub(super) fn with(self, delay_s: Option<f64>, jitter_s: Option<f64>) -> Option<Self> {
        if delay_s.is_none() && jitter_s.is_none() {
            return Some(self);
        }
        match self {
            Self::Normal { mean_s, sigma_s } => {
                Some(Self::Normal { mean_s: delay_s.unwrap_or(mean_s), sigma_s: jitter_s.unwrap_or(sigma_s) })
            }
            Self::LogNormal { sigma_ln, .. } if jitter_s.is_none() => {
                Some(Self::LogNormal { median_s: delay_s?, sigma_ln })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::testing::assert_same_distribution;
    use rand::Rng;
    use rand::distr::Distribution;
    use rand_distr::{Binomial, Gamma, LogNormal};

    fn draw(delay: Delay) -> impl FnMut(&mut ChaCha8Rng) -> f64 {
        move |rng| delay.draw(rng, Span::ZERO)
    }

    /// `offset` + `scale` · a draw of the law.
    struct Affine<D>(D, f64, f64);

    impl<D: Distribution<f64>> Distribution<f64> for Affine<D> {
        fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> f64 {
            let Self(law, offset, scale) = self;
            offset + scale * law.sample(rng)
        }
    }

    #[test]
    fn log_normal_delays_have_the_distribution_of_rand_distr() {
        let oracle = LogNormal::new(libm::log(0.05), 0.5).unwrap();
        assert_same_distribution(draw(Delay::LogNormal { median_s: 0.05, sigma_ln: 0.5 }), &oracle);
    }

    #[test]
    fn gamma_delays_have_the_distribution_of_rand_distr() {
        // min + Gamma(2, 2) (expected - min) / 4.
        let oracle = Affine(Gamma::new(2.0, 2.0).unwrap(), 0.05, 0.025);
        assert_same_distribution(draw(Delay::Gamma { min_s: 0.05, expected_s: 0.15 }), &oracle);
    }

    #[test]
    fn delays_of_whole_frames_have_the_distribution_of_rand_distr() {
        struct Frames(Binomial);
        impl Distribution<f64> for Frames {
            fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> f64 {
                self.0.sample(rng) as f64 * 0.1
            }
        }
        let oracle = Frames(Binomial::new(u64::from(MAX_FRAMES), 0.3).unwrap());
        // Products with 0.1 are compared exactly: both compute the same ones.
        assert_same_distribution(draw(Delay::Frames { p: 0.3, frame_s: 0.1 }), &oracle);
    }
}
