//! Measurements of true boxes.

use rand::distr::Distribution;
use rand_chacha::ChaCha8Rng;
use v2x_common::detection::{MAX_SIZE_M, MIN_SIZE_M};
use v2x_common::geometry::{BevBox, Pose, wrap_angle};

use super::law::NoiseLaw;
use super::model::NoiseModel;
use crate::random::{StandardNormal, truncated_normal};

/// The errors of a sensor: standard deviations of a [`NoiseModel`], and the laws from which the errors are drawn.
#[derive(Clone, Debug)]
pub struct MeasurementNoise {
    model: NoiseModel,
    /// Of x and y in units of their σ.
    position: NoiseLaw,
    /// Of the heading in units of its σ.
    heading: NoiseLaw,
    /// Of the size factors; `None`: the truncated normal of the model.
    size: Option<NoiseLaw>,
}

impl MeasurementNoise {
    /// Normal errors of position and heading, truncated normal factors of size (paper, section II).
    pub fn new(model: NoiseModel) -> Self {
        let standard_normal = NoiseLaw::new(StandardNormal);
        Self { model, position: standard_normal.clone(), heading: standard_normal, size: None }
    }

    /// Draws the errors of x and y, in units of their σ, from this law.
    #[must_use]
    pub fn with_position_law(self, law: impl Distribution<f64> + Send + Sync + 'static) -> Self {
        Self { position: NoiseLaw::new(law), ..self }
    }

    /// Draws the error of the heading, in units of its σ, from this law.
    #[must_use]
    pub fn with_heading_law(self, law: impl Distribution<f64> + Send + Sync + 'static) -> Self {
        Self { heading: NoiseLaw::new(law), ..self }
    }

    /// Draws the factors measured size / true size from this law.
    #[must_use]
    pub fn with_size_law(self, law: impl Distribution<f64> + Send + Sync + 'static) -> Self {
        Self { size: Some(NoiseLaw::new(law)), ..self }
    }

    /// The standard deviations.
    pub const fn model(&self) -> &NoiseModel {
        &self.model
    }

    /// Measures a true box from the sensor's true pose, both in the map frame.
    ///
    /// By the default laws sizes stay below what the wire can carry (65 m; for an 18 m bus this cuts factors above
    /// 3.6): a factor beyond it is drawn again, not clamped. By other laws a measurement can be anything: check it
    /// with [`v2x_common::detection::Detection::validate`].
    pub fn measure(&self, truth: &BevBox, sensor: &Pose, rng: &mut ChaCha8Rng) -> BevBox {
        let range_m = sensor.distance_to(truth.x, truth.y);
        let position_sigma_m = self.model.position_sigma_m(range_m);
        BevBox {
            x: truth.x + position_sigma_m * self.position.draw(rng),
            y: truth.y + position_sigma_m * self.position.draw(rng),
            w: truth.w * self.size_factor(truth.w, rng),
            d: truth.d * self.size_factor(truth.d, rng),
            yaw: wrap_angle(truth.yaw + self.model.yaw_sigma_rad(range_m) * self.heading.draw(rng)),
        }
    }

    /// A factor for a true width or depth (m): eq. (5)-(6) of the paper, truncated below.
    fn size_factor(&self, size_m: f64, rng: &mut ChaCha8Rng) -> f64 {
        if let Some(law) = &self.size {
            return law.draw(rng);
        }
        let law = &self.model.size;
        let bounds = (law.lower.max(MIN_SIZE_M / size_m), MAX_SIZE_M / size_m);
        truncated_normal(rng, 1.0, law.sigma, bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::NoiseLevel;
    use crate::random::{Purpose, keyed_rng};
    use proptest::prelude::*;
    use v2x_common::geometry::angle_difference;

    const CAR: BevBox = BevBox { x: 30.0, y: 40.0, w: 1.8, d: 4.5, yaw: 3.1 };
    const SENSOR: Pose = Pose { x: 0.0, y: 0.0, yaw: 0.7 };
    const N: usize = 60_000;

    fn measurements(level: NoiseLevel) -> Vec<BevBox> {
        let noise = MeasurementNoise::new(level.model());
        let mut rng = keyed_rng(5, None, 0, Purpose::Clutter);
        (0..N).map(|_| noise.measure(&CAR, &SENSOR, &mut rng)).collect()
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
    fn errors_of_position_and_heading_have_the_standard_deviations_of_the_formulas() {
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
        // Mean and coefficient of variation for lower bound 0.1: deploy/docs/methods.md.
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
    fn a_reported_covariance_reveals_no_more_than_the_measurement() {
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
    fn a_long_bus_is_measured_at_most_as_long_as_the_wire_can_carry() {
        let bus = BevBox { w: 2.55, d: 19.0, ..CAR };
        let noise = MeasurementNoise::new(NoiseLevel::N3.model());
        let mut rng = keyed_rng(5, None, 0, Purpose::Clutter);
        let longest = (0..N).map(|_| noise.measure(&bus, &SENSOR, &mut rng).d).fold(0.0, f64::max);
        assert!(longest > 60.0 && longest <= MAX_SIZE_M, "{longest}");
    }

    fn boxes() -> impl Strategy<Value = BevBox> {
        let numbers = (-500.0..500.0, -500.0..500.0, 0.3..3.0, 0.3..20.0, -3.1..3.1);
        numbers.prop_map(|(x, y, w, d, yaw)| BevBox { x, y, w, d, yaw })
    }

    proptest! {
        #[test]
        fn every_measurement_can_be_encoded(
            truth in boxes(), seed in any::<u64>(),
        ) {
            let mut rng = keyed_rng(seed, None, 0, Purpose::Clutter);
            let model = NoiseLevel::N3.model();
            let bev = MeasurementNoise::new(model).measure(&truth, &SENSOR, &mut rng);
            let detection = v2x_common::detection::Detection {
                class: v2x_common::class::Class::Car,
                score: 1.0,
                bev,
                covariance: model.reported_covariance(&bev, &SENSOR),
                velocity: None,
                heading: v2x_common::detection::HeadingKind::Known,
                source_track: None,
            };
            prop_assert_eq!(detection.validate(Some(&SENSOR)), Ok(()));
        }
    }
}
