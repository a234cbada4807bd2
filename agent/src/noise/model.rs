//! The paper's noise model: position and heading err more with distance, sizes by a factor.

use rand_chacha::ChaCha8Rng;
use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::detection::{MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};
use v2x_common::sensor::SizeNoiseLaw;

use crate::random::{standard_normal, truncated_normal};

/// Growth of the position's σ with range, m per m (paper, section II).
const POSITION_PER_M: f64 = 0.01;
/// Growth of the heading's σ with range, degrees per m (paper, section II).
const YAW_DEG_PER_M: f64 = 0.1;
/// Smallest size factor; the paper names none, 0.05 to 0.1 fits its tables (METHODS.md 13.1).
pub const DEFAULT_SIZE_LOWER: f64 = 0.1;

/// The paper's three levels of noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseLevel {
    /// 0.2 m, 0.2°, sizes 20 %.
    N1,
    /// 0.5 m, 5°, sizes 50 %.
    N2,
    /// 1 m, 10°, sizes 100 %.
    N3,
}

impl NoiseLevel {
    /// The level's name in scenario files.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "N1" => Some(Self::N1),
            "N2" => Some(Self::N2),
            "N3" => Some(Self::N3),
            _ => None,
        }
    }

    /// The level's numbers (paper, table I).
    pub fn model(self) -> NoiseModel {
        let (position_m, yaw_deg, size) = match self {
            Self::N1 => (0.2, 0.2, 0.2),
            Self::N2 => (0.5, 5.0, 0.5),
            Self::N3 => (1.0, 10.0, 1.0),
        };
        NoiseModel {
            position_m,
            position_per_m: POSITION_PER_M,
            yaw_rad: f64::to_radians(yaw_deg),
            yaw_rad_per_m: f64::to_radians(YAW_DEG_PER_M),
            size: SizeNoiseLaw { sigma: size, lower: DEFAULT_SIZE_LOWER },
        }
    }
}

/// How a sensor errs: σ_xy = `position_m` + `position_per_m` · range, σ_θ likewise, and
/// measured size = factor × true size with the factor from `size`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseModel {
    /// σ of x and of y at range 0, m.
    pub position_m: f64,
    /// Growth of that σ with range, m per m.
    pub position_per_m: f64,
    /// σ of the heading at range 0, rad.
    pub yaw_rad: f64,
    /// Growth of that σ with range, rad per m.
    pub yaw_rad_per_m: f64,
    /// Law of the size factors.
    pub size: SizeNoiseLaw,
}

impl NoiseModel {
    /// σ of x and of y (m) for an object at this range.
    pub fn position_sigma_m(&self, range_m: f64) -> f64 {
        self.position_m + self.position_per_m * range_m
    }

    /// σ of the heading (rad) for an object at this range.
    pub fn yaw_sigma_rad(&self, range_m: f64) -> f64 {
        self.yaw_rad + self.yaw_rad_per_m * range_m
    }

    /// Measures a true box from the sensor's true pose, both in the map frame.
    ///
    /// The size factors are also kept below what the wire can carry (65 m; for an 18 m bus this cuts
    /// factors above 3.6), by drawing again and not by clamping.
    pub fn perturb(&self, truth: &BevBox, sensor: &Pose, rng: &mut ChaCha8Rng) -> BevBox {
        let range_m = sensor.distance_to(truth.x, truth.y);
        let position_sigma_m = self.position_sigma_m(range_m);
        BevBox {
            x: truth.x + position_sigma_m * standard_normal(rng),
            y: truth.y + position_sigma_m * standard_normal(rng),
            w: truth.w * self.size_factor(truth.w, rng),
            d: truth.d * self.size_factor(truth.d, rng),
            yaw: wrap_angle(truth.yaw + self.yaw_sigma_rad(range_m) * standard_normal(rng)),
        }
    }

    /// A factor for a true width or depth (m): eq. (5)-(6) of the paper, truncated below.
    fn size_factor(&self, size_m: f64, rng: &mut ChaCha8Rng) -> f64 {
        let bounds = (self.size.lower.max(MIN_SIZE_M / size_m), MAX_SIZE_M / size_m);
        truncated_normal(rng, 1.0, self.size.sigma, bounds)
    }

    /// What the sensor can know of the error of its own measurement: everything from the *measured*
    /// range (to the pose that the agent believes to have) and the *measured* size. From the true ones
    /// a receiver could compute the truth.
    pub fn reported_covariance(&self, measured: &BevBox, believed_pose: &Pose) -> BoxCovariance {
        let range_m = believed_pose.distance_to(measured.x, measured.y);
        let yaw_sigma = self.yaw_sigma_rad(range_m);
        let (w_sigma, d_sigma) = (self.size.sigma * measured.w, self.size.sigma * measured.d);
        BoxCovariance {
            position: Covariance2::isotropic(self.position_sigma_m(range_m)),
            ww: w_sigma * w_sigma,
            dd: d_sigma * d_sigma,
            yaw: yaw_sigma * yaw_sigma,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, keyed_rng};
    use proptest::prelude::*;
    use v2x_common::geometry::angle_difference;

    const CAR: BevBox = BevBox { x: 30.0, y: 40.0, w: 1.8, d: 4.5, yaw: 3.1 };
    const SENSOR: Pose = Pose { x: 0.0, y: 0.0, yaw: 0.7 };
    const N: usize = 60_000;

    fn measurements(level: NoiseLevel) -> Vec<BevBox> {
        let mut rng = keyed_rng(5, None, 0, Purpose::Clutter);
        (0..N).map(|_| level.model().perturb(&CAR, &SENSOR, &mut rng)).collect()
    }

    fn moments(values: impl Iterator<Item = f64>) -> (f64, f64) {
        let values: Vec<f64> = values.collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (mean, libm::sqrt(values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n))
    }

    /// The tolerance of all statistics here: standard errors of σ are 0.3 % at this number of draws.
    fn is_close(value: f64, expected: f64) -> bool {
        (value / expected - 1.0).abs() < 0.012
    }

    #[test]
    fn position_and_heading_err_as_the_formulas_say() {
        // Range 50 m: σ = s0 + 0.5 m, and t0 + 5°.
        for (level, sigma_m, sigma_deg) in
            [(NoiseLevel::N1, 0.7, 5.2), (NoiseLevel::N2, 1.0, 10.0), (NoiseLevel::N3, 1.5, 15.0)]
        {
            let boxes = measurements(level);
            for errors in [
                boxes.iter().map(|b| b.x - 30.0).collect::<Vec<_>>(),
                boxes.iter().map(|b| b.y - 40.0).collect(),
            ] {
                let (mean, std) = moments(errors.into_iter());
                assert!(mean.abs() < 0.02 && is_close(std, sigma_m), "{level:?}: {mean} {std}");
            }
            let (mean, std) = moments(boxes.iter().map(|b| angle_difference(b.yaw, 3.1).to_degrees()));
            assert!(mean.abs() < 0.2 && is_close(std, sigma_deg), "{level:?}: {mean} {std}");
            assert!(boxes.iter().all(|b| b.yaw.abs() <= std::f64::consts::PI));
        }
    }

    #[test]
    fn size_factors_have_the_moments_of_the_truncated_normal() {
        // Mean and coefficient of variation for lower bound 0.1: METHODS.md, section 12.
        for (level, mean, variation) in
            [(NoiseLevel::N1, 1.000, 0.200), (NoiseLevel::N2, 1.041, 0.442), (NoiseLevel::N3, 1.326, 0.584)]
        {
            let boxes = measurements(level);
            for factors in [
                boxes.iter().map(|b| b.w / 1.8).collect::<Vec<_>>(),
                boxes.iter().map(|b| b.d / 4.5).collect(),
            ] {
                assert!(factors.iter().all(|factor| *factor >= 0.1));
                let (m, std) = moments(factors.into_iter());
                assert!(is_close(m, mean) && is_close(std / m, variation), "{level:?}: {m} {}", std / m);
            }
        }
    }

    #[test]
    fn the_errors_of_one_measurement_are_independent() {
        let boxes = measurements(NoiseLevel::N2);
        let errors =
            |b: &BevBox| [b.x - 30.0, b.y - 40.0, b.w - 1.87, b.d - 4.68, angle_difference(b.yaw, 3.1)];
        let mut products = [[0.0; 5]; 5];
        for b in &boxes {
            let e = errors(b);
            for i in 0..5 {
                for j in 0..5 {
                    products[i][j] += e[i] * e[j];
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate().filter(|(j, _)| *j != i) {
                let correlation = product / libm::sqrt(products[i][i] * products[j][j]);
                // Four standard errors.
                assert!(correlation.abs() < 0.017, "{i} {j}: {correlation}");
            }
        }
    }

    #[test]
    fn range_and_size_recovered_from_a_reported_sigma_are_no_nearer_to_the_truth_than_the_measurement() {
        let model = NoiseLevel::N1.model();
        for measured in measurements(NoiseLevel::N1).iter().take(1000) {
            let covariance = model.reported_covariance(measured, &SENSOR);
            let recovered_m = (libm::sqrt(covariance.position.xx) - 0.2) / 0.01;
            let from_yaw_m = (libm::sqrt(covariance.yaw).to_degrees() - 0.2) / 0.1;
            let measured_m = SENSOR.distance_to(measured.x, measured.y);
            let off = (recovered_m - 50.0).abs() - (measured_m - 50.0).abs();
            assert!(off.abs() < 1e-6 && (from_yaw_m - measured_m).abs() < 1e-6, "{recovered_m} {measured_m}");
            assert!((libm::sqrt(covariance.ww) / 0.2 - measured.w).abs() < 1e-9);
            assert!((libm::sqrt(covariance.dd) / 0.2 - measured.d).abs() < 1e-9);
        }
    }

    #[test]
    fn a_long_bus_is_never_measured_longer_than_the_wire_can_carry() {
        let bus = BevBox { w: 2.55, d: 19.0, ..CAR };
        let mut rng = keyed_rng(5, None, 0, Purpose::Clutter);
        let longest =
            (0..N).map(|_| NoiseLevel::N3.model().perturb(&bus, &SENSOR, &mut rng).d).fold(0.0, f64::max);
        assert!(longest > 60.0 && longest <= MAX_SIZE_M, "{longest}");
    }

    proptest! {
        #[test]
        fn whatever_is_measured_can_be_sent(
            x in -500.0..500.0f64, y in -500.0..500.0f64, yaw in -3.1..3.1f64, w in 0.3..3.0f64, d in 0.3..20.0f64,
            seed in any::<u64>(),
        ) {
            let mut rng = keyed_rng(seed, None, 0, Purpose::Clutter);
            let model = NoiseLevel::N3.model();
            let bev = model.perturb(&BevBox { x, y, w, d, yaw }, &SENSOR, &mut rng);
            let detection = v2x_common::detection::Detection {
                class: v2x_common::class::Class::Car,
                score: 1.0,
                bev,
                covariance: model.reported_covariance(&bev, &SENSOR),
                velocity: None,
                source_track: None,
            };
            prop_assert_eq!(detection.validate(Some(&SENSOR)), Ok(()));
        }
    }
}
