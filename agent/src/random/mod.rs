//! Random numbers that depend on their purpose alone.
//!
//! Each draw has its own ChaCha8 stream, keyed by (seed, agent, sequence, purpose). So one more agent or object in the
//! world does not change the draws of the others.
//!
//! The built-in distributions are computed with `libm`. Those of `rand_distr` call the platform's `exp` as soon as any
//! crate of the build enables `num-traits/std`, and then give other bits on other machines.

mod draws;
mod gauss_markov;
mod keyed;
mod laws;

pub use draws::{chance, poisson, standard_normal, truncated_normal, uniform, unit, weighted};
pub(crate) use gauss_markov::GaussMarkov;
pub use keyed::{DetectorStream, Purpose, WorldDraw, keyed_rng};
pub use laws::StandardNormal;

#[cfg(test)]
pub(crate) mod testing;
