//! Random numbers that depend on what they are for and on nothing else.
//!
//! Each draw has its own ChaCha8 stream, keyed by (seed, agent, sequence, purpose). So another agent or
//! another object in the world changes nobody's draws.
//!
//! Distributions are written out here, over `libm`: those of `rand_distr` call the platform's `exp` as soon as any
//! crate of the build turns on `num-traits/std`, and then give other bits on other machines.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::f64::consts::TAU;
use v2x_common::id::AgentId;

use crate::truth::ObjectId;

/// What a stream of random numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Layout of the world and its traffic; the sequence is the place that is being filled.
    World(WorldDraw),
    /// Whether one object is detected in a frame, and with which error.
    Measurement(ObjectId),
    /// How a vehicle errs about its own pose in a frame.
    SelfReport,
    /// False detections of a frame.
    Clutter,
    /// Order of the detections in a frame.
    Order,
    /// Loss and delay of a frame.
    Link,
    /// Whether a frame falls into a burst of losses.
    LossBurst,
    /// How an agent errs about its pose; the sequence is a frame number.
    PoseError,
    /// How long a frame takes from capture to being ready.
    Sensing,
    /// When an agent's first frame is captured, where that is left to chance.
    CapturePhase,
    /// When its opportunities to send are, where that is left to chance.
    TransmitPhase,
}

/// Which part of the world is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorldDraw {
    /// A place in a lane's traffic.
    Traffic,
    /// A bicycle.
    Bicycle,
    /// A person on foot.
    Pedestrian,
    /// A parked or standing vehicle.
    Parked,
    /// Which of the parking places are taken.
    ParkingPlaces,
    /// A cone or barrier.
    Works,
    /// The body of a vehicle agent.
    AgentBody,
}

impl Purpose {
    /// Eight bytes, different for each purpose.
    fn key(self) -> u64 {
        let (major, minor) = match self {
            Self::World(draw) => (1, draw as u32),
            Self::Measurement(object) => (2, object.0),
            Self::SelfReport => (3, 0),
            Self::Clutter => (4, 0),
            Self::Order => (5, 0),
            Self::Link => (6, 0),
            Self::LossBurst => (7, 0),
            Self::PoseError => (8, 0),
            Self::Sensing => (9, 0),
            Self::CapturePhase => (10, 0),
            Self::TransmitPhase => (11, 0),
        };
        u64::from(minor) << 32 | major
    }
}

/// The generator of one draw. `agent` is `None` for what belongs to the world.
pub fn keyed_rng(seed: u64, agent: Option<&AgentId>, sequence: u64, purpose: Purpose) -> ChaCha8Rng {
    let words = [seed, agent.map_or(0, stable_hash), sequence, purpose.key()];
    let mut key = [0; 32];
    for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    ChaCha8Rng::from_seed(key)
}

/// FNV-1a: the same on every machine and in every version, unlike std's hashers.
fn stable_hash(agent: &AgentId) -> u64 {
    agent
        .as_str()
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// A number in [0, 1).
pub fn unit(rng: &mut ChaCha8Rng) -> f64 {
    rng.random::<f64>()
}

/// A number in [`low`, `high`).
pub fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * unit(rng)
}

/// True with the given probability.
pub fn chance(rng: &mut ChaCha8Rng, probability: f64) -> bool {
    unit(rng) < probability
}

/// A draw from the standard normal distribution (Box-Muller, one of the pair).
pub fn standard_normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v) = (1.0 - unit(rng), unit(rng));
    libm::sqrt(-2.0 * libm::log(u)) * libm::cos(TAU * v)
}

/// A draw from Normal(`mean`, `sigma`²) given that it lies in [`lower`, `upper`], by rejection.
///
/// `mean` must lie in the interval; then at least about a tenth of the draws are accepted wherever the
/// interval is not far narrower than `sigma`.
pub fn truncated_normal(rng: &mut ChaCha8Rng, mean: f64, sigma: f64, (lower, upper): (f64, f64)) -> f64 {
    debug_assert!(lower <= mean && mean <= upper, "{mean} outside of {lower}..{upper}");
    loop {
        let draw = mean + sigma * standard_normal(rng);
        if (lower..=upper).contains(&draw) {
            return draw;
        }
    }
}

/// A draw from the Poisson distribution (Knuth's product of uniforms: for means up to some hundred).
pub fn poisson(rng: &mut ChaCha8Rng, mean: f64) -> u32 {
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
pub fn weighted<T: Copy>(rng: &mut ChaCha8Rng, choices: &[(T, f64)]) -> T {
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

    fn rng() -> ChaCha8Rng {
        keyed_rng(1, None, 0, Purpose::Clutter)
    }

    fn moments(draws: &[f64]) -> (f64, f64) {
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        (mean, draws.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n)
    }

    #[test]
    fn every_part_of_the_key_matters() {
        let agents = [AgentId::new("a").unwrap(), AgentId::new("b").unwrap()];
        let mut firsts: Vec<u64> = [
            keyed_rng(1, None, 0, Purpose::Clutter),
            keyed_rng(2, None, 0, Purpose::Clutter),
            keyed_rng(1, Some(&agents[0]), 0, Purpose::Clutter),
            keyed_rng(1, Some(&agents[1]), 0, Purpose::Clutter),
            keyed_rng(1, None, 1, Purpose::Clutter),
            keyed_rng(1, None, 0, Purpose::Order),
            keyed_rng(1, None, 0, Purpose::Measurement(ObjectId(1))),
            keyed_rng(1, None, 0, Purpose::Measurement(ObjectId(2))),
            keyed_rng(1, None, 0, Purpose::World(WorldDraw::Traffic)),
            keyed_rng(1, None, 0, Purpose::World(WorldDraw::Bicycle)),
        ]
        .iter_mut()
        .map(|rng| rng.random())
        .collect();
        firsts.sort_unstable();
        firsts.dedup();
        assert_eq!(firsts.len(), 10);
    }

    #[test]
    fn the_stream_of_a_key_never_changes() {
        let agent = AgentId::new("ego").unwrap();
        let mut rng = keyed_rng(1, Some(&agent), 7, Purpose::Link);
        // The first draw as this test's failure prints it; a change of it changes every scenario's runs.
        assert_eq!(rng.random::<u64>(), 5_105_196_772_680_445_547);
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
    fn weights_are_respected() {
        let mut rng = rng();
        let n_heavy = (0..10_000).filter(|_| weighted(&mut rng, &[(true, 3.0), (false, 1.0)])).count();
        assert!((7300..7700).contains(&n_heavy), "{n_heavy}");
    }
}
