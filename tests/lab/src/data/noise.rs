//! The paper's noise (deploy/docs/methods.md), in several shapes, keyed by scene, frame, agent and object.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};
use v2x_agent::noise::{NoiseLevel, NoiseModel};
use v2x_agent::random::{DetectorStream, standard_normal, unit};
use v2x_common::detection::{MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};

/// Degrees of freedom of [`Shape::StudentT`].
const STUDENT_DOF: u32 = 5;

/// The shape of all errors; each has mean 0 and standard deviation 1 before it is scaled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "lab", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// The paper's
    #[default]
    Gaussian,
    /// Bounded at √3 σ
    Uniform,
    /// Heavier tails
    Laplace,
    /// Student's t with 5 degrees of freedom: the heaviest tails
    StudentT,
}

impl Shape {
    /// All shapes.
    pub const ALL: [Self; 4] = [Self::Gaussian, Self::Uniform, Self::Laplace, Self::StudentT];

    /// The name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gaussian => "gaussian",
            Self::Uniform => "uniform",
            Self::Laplace => "laplace",
            Self::StudentT => "student-t",
        }
    }

    /// A draw of mean 0 and variance 1.
    pub fn draw(self, rng: &mut ChaCha8Rng) -> f64 {
        match self {
            Self::Gaussian => standard_normal(rng),
            Self::Uniform => (2.0 * unit(rng) - 1.0) * libm::sqrt(3.0),
            // By inversion; the variance of a Laplace distribution of scale b is 2 b².
            Self::Laplace => {
                let u = unit(rng) - 0.5;
                let magnitude = -libm::log(1.0 - 2.0 * u.abs()) / libm::sqrt(2.0);
                if u < 0.0 { -magnitude } else { magnitude }
            }
            // Its variance is ν / (ν − 2).
            Self::StudentT => {
                let normal = standard_normal(rng);
                let chi2: f64 = (0..STUDENT_DOF).map(|_| standard_normal(rng)).map(|z| z * z).sum();
                normal * libm::sqrt(f64::from(STUDENT_DOF - 2) / chi2)
            }
        }
    }
}

/// The levels of noise of agents 1 and 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "lab", derive(clap::ValueEnum))]
pub enum NoisePair {
    /// Both Noise 1
    #[serde(rename = "N1-N1")]
    #[cfg_attr(feature = "lab", value(name = "N1-N1"))]
    N1N1,
    /// Both Noise 2
    #[serde(rename = "N2-N2")]
    #[cfg_attr(feature = "lab", value(name = "N2-N2"))]
    N2N2,
    /// Both Noise 3
    #[serde(rename = "N3-N3")]
    #[cfg_attr(feature = "lab", value(name = "N3-N3"))]
    N3N3,
    /// Noise 1 and Noise 3
    #[serde(rename = "N1-N3")]
    #[cfg_attr(feature = "lab", value(name = "N1-N3"))]
    N1N3,
}

impl NoisePair {
    /// Those of the paper's Table II, in its order.
    pub const ALL: [Self; 4] = [Self::N1N1, Self::N2N2, Self::N3N3, Self::N1N3];

    /// Of agents 1 and 2.
    pub const fn levels(self) -> [NoiseLevel; 2] {
        match self {
            Self::N1N1 => [NoiseLevel::N1, NoiseLevel::N1],
            Self::N2N2 => [NoiseLevel::N2, NoiseLevel::N2],
            Self::N3N3 => [NoiseLevel::N3, NoiseLevel::N3],
            Self::N1N3 => [NoiseLevel::N1, NoiseLevel::N3],
        }
    }

    /// The name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::N1N1 => "N1-N1",
            Self::N2N2 => "N2-N2",
            Self::N3N3 => "N3-N3",
            Self::N1N3 => "N1-N3",
        }
    }

    /// Overlap (IoU or GIoU) above which boxes are of one object (paper, Table I). The paper gives no value for N1-N3; the
    /// value of the higher noise is used.
    pub const fn overlap_threshold(self) -> f64 {
        match self {
            Self::N1N1 | Self::N2N2 => 0.5,
            Self::N3N3 | Self::N1N3 => 0.3,
        }
    }
}

/// Purpose of a stream of random numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// An agent's measurement of an object.
    Measurement {
        /// Place of the agent.
        agent: u32,
        /// Number of the object.
        object: u32,
    },
    /// The place of an agent.
    Place,
    /// The order of an agent's detections.
    Order {
        /// Place of the agent.
        agent: u32,
    },
    /// Whether an agent detects an object.
    Detection {
        /// Place of the agent.
        agent: u32,
        /// Number of the object.
        object: u32,
    },
    /// An agent's clutter.
    Clutter {
        /// Place of the agent.
        agent: u32,
    },
    /// How an agent's detector errs on an object.
    Detector {
        /// Place of the agent.
        agent: u32,
        /// Number of the object.
        object: u32,
        /// Which of its errors.
        stream: DetectorStream,
    },
    /// An agent's false objects that stay.
    FalseObjects {
        /// Place of the agent.
        agent: u32,
    },
}

/// One realisation of the noise. Draws do not depend on methods, on levels of noise, or on other scenes: all methods get
/// the same errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Realisation {
    /// The table's seed.
    pub seed: u64,
    /// The number of the trial.
    pub trial: u32,
}

impl Realisation {
    /// The stream of random numbers for one purpose in one frame.
    pub(crate) fn rng(&self, scene: &str, frame: u32, purpose: Purpose) -> ChaCha8Rng {
        let (kind, object) = match purpose {
            Purpose::Measurement { agent, object } => (agent, object),
            Purpose::Place => (1 << 16, 0),
            Purpose::Order { agent } => (1 << 17 | agent, 0),
            Purpose::Detection { agent, object } => (1 << 18 | agent, object),
            Purpose::Clutter { agent } => (1 << 19 | agent, 0),
            Purpose::Detector { agent, object, stream } => (1 << 20 | (stream as u32) << 8 | agent, object),
            Purpose::FalseObjects { agent } => (1 << 21 | agent, 0),
        };
        let words = [
            self.seed,
            stable_hash(scene),
            u64::from(self.trial) << 32 | u64::from(frame),
            u64::from(kind) << 32 | u64::from(object),
        ];
        let mut key = [0; 32];
        for (bytes, word) in key.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        ChaCha8Rng::from_seed(key)
    }
}

/// FNV-1a: the same on every machine and in every version, unlike std's hashers.
pub(crate) fn stable_hash(text: &str) -> u64 {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    text.bytes().fold(0xcbf2_9ce4_8422_2325, step)
}

/// Fisher-Yates shuffle.
pub(super) fn shuffle<T>(items: &mut [T], rng: &mut ChaCha8Rng) {
    for last in (1..items.len()).rev() {
        items.swap(last, rng.random_range(0..=last));
    }
}

/// Measures a true box with a sensor at this pose.
pub(crate) fn perturb(
    truth: &BevBox,
    sensor: &Pose,
    (model, shape): (&NoiseModel, Shape),
    rng: &mut ChaCha8Rng,
) -> BevBox {
    let range_m = sensor.distance_to(truth.x, truth.y);
    let position_sigma_m = model.position_sigma_m(range_m);
    let [dx, dy, turn] = std::array::from_fn(|_| shape.draw(rng));
    BevBox {
        x: truth.x + position_sigma_m * dx,
        y: truth.y + position_sigma_m * dy,
        yaw: wrap_angle(truth.yaw + model.yaw_sigma_rad(range_m) * turn),
        w: truth.w * size_factor(truth.w, (model, shape), rng),
        d: truth.d * size_factor(truth.d, (model, shape), rng),
    }
}

/// A factor for a true width or depth (m): eq. (5)-(6), truncated below (deploy/docs/methods.md), and above at the limit of the
/// wire format. Values outside are drawn again.
fn size_factor(size_m: f64, (model, shape): (&NoiseModel, Shape), rng: &mut ChaCha8Rng) -> f64 {
    let bounds = model.size.lower.max(MIN_SIZE_M / size_m)..=MAX_SIZE_M / size_m;
    loop {
        let factor = 1.0 + model.size.sigma * shape.draw(rng);
        if bounds.contains(&factor) {
            return factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: Realisation = Realisation { seed: 1, trial: 0 };

    #[test]
    fn every_shape_has_mean_0_and_variance_1() {
        for shape in Shape::ALL {
            let mut rng = ONE.rng("shapes", 0, Purpose::Place);
            let draws: Vec<f64> = (0..200_000).map(|_| shape.draw(&mut rng)).collect();
            let n = draws.len() as f64;
            let mean = draws.iter().sum::<f64>() / n;
            let variance = draws.iter().map(|x| x * x).sum::<f64>() / n;
            // Standard error of the mean 0.0022; of the variance at most 0.0063 (Student: kurtosis 9).
            assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.025, "{shape:?}: {mean} {variance}");
        }
    }

    #[test]
    fn the_noise_depends_on_every_part_of_the_key() {
        let measurement = |agent, object| Purpose::Measurement { agent, object };
        let mut firsts: Vec<u64> = [
            ONE.rng("a", 0, measurement(0, 0)),
            ONE.rng("b", 0, measurement(0, 0)),
            ONE.rng("a", 1, measurement(0, 0)),
            ONE.rng("a", 0, measurement(1, 0)),
            ONE.rng("a", 0, measurement(0, 1)),
            ONE.rng("a", 0, Purpose::Place),
            ONE.rng("a", 0, Purpose::Order { agent: 0 }),
            ONE.rng("a", 0, Purpose::Order { agent: 1 }),
            ONE.rng("a", 0, Purpose::Detection { agent: 0, object: 0 }),
            ONE.rng("a", 0, Purpose::Clutter { agent: 0 }),
            Realisation { trial: 1, ..ONE }.rng("a", 0, measurement(0, 0)),
            Realisation { seed: 2, ..ONE }.rng("a", 0, measurement(0, 0)),
        ]
        .iter_mut()
        .map(|rng| rng.random())
        .collect();
        firsts.sort_unstable();
        firsts.dedup();
        assert_eq!(firsts.len(), 12);
    }

    #[test]
    fn position_and_heading_errors_use_the_same_draws_at_every_level() {
        let (truth, sensor) = (BevBox { x: 30.0, y: 40.0, w: 2.0, d: 4.0, yaw: 0.0 }, Pose::default());
        let [low, high] = [NoiseLevel::N1, NoiseLevel::N3].map(|level| {
            let mut rng = ONE.rng("a", 0, Purpose::Place);
            perturb(&truth, &sensor, (&level.model(), Shape::Gaussian), &mut rng)
        });
        // σ at 50 m: 0.7 and 1.5 m, 5.2 and 15 degrees.
        assert!(((high.x - 30.0) / (low.x - 30.0) - 1.5 / 0.7).abs() < 1e-9);
        assert!((high.yaw / low.yaw - 15.0 / 5.2).abs() < 1e-9);
    }
}
