//! What a sensor description means for the reports made under it.

use crate::filter::Measurement;
use crate::track::{Look, Sighting};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use v2x_common::detection::Detection;
use v2x_common::geometry::Pose;
use v2x_common::sensor::{SensorDescription, SizeNoiseLaw};

/// Detection probability above which a sensor is not believed: one miss must not be proof.
const MAX_DETECTION_PROBABILITY: f64 = 0.999;

/// Assumptions about agents that describe no sensor, and about new objects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensingDefaults {
    /// Detection probability of an agent that declares none (its misses count for nothing).
    pub detection_probability: f64,
    /// Expected false reports of such an agent in a frame, per m².
    pub clutter_per_m2: f64,
    /// Expected objects that come into view anew in a frame, per m².
    pub births_per_m2: f64,
}

impl Default for SensingDefaults {
    fn default() -> Self {
        Self { detection_probability: 0.9, clutter_per_m2: 1e-6, births_per_m2: 1e-5 }
    }
}

/// One agent's sensor, as the evidence needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensing {
    ln_detection_over_clutter: f64,
    birth_odds: f64,
    miss_probability: f64,
    size_factor: SizeFactor,
}

/// Mean and coefficient of variation of the factor by which sizes are measured, where a law is declared.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SizeFactor {
    Undeclared,
    Declared { mean: f64, relative_variance: f64 },
}

impl Default for Sensing {
    fn default() -> Self {
        Self::undescribed(&SensingDefaults::default())
    }
}

impl Sensing {
    /// Of an agent that describes no sensor.
    pub fn undescribed(defaults: &SensingDefaults) -> Self {
        Self::new(defaults.detection_probability, defaults.clutter_per_m2, None, defaults)
    }

    /// Of a described sensor.
    pub fn described(description: &SensorDescription, defaults: &SensingDefaults) -> Self {
        let SensorDescription { detection_probability, clutter_per_m2, size_noise, .. } = description;
        Self::new(*detection_probability, *clutter_per_m2, *size_noise, defaults)
    }

    fn new(
        detection_probability: f64,
        clutter_per_m2: f64,
        size_noise: Option<SizeNoiseLaw>,
        defaults: &SensingDefaults,
    ) -> Self {
        let p = detection_probability.min(MAX_DETECTION_PROBABILITY);
        Self {
            ln_detection_over_clutter: libm::log(p) - libm::log(clutter_per_m2),
            birth_odds: defaults.births_per_m2 / clutter_per_m2,
            miss_probability: 1.0 - p,
            size_factor: size_noise.map_or(SizeFactor::Undeclared, |law| SizeFactor::of(&law)),
        }
    }

    /// A detection as evidence.
    pub fn sighting(&self, detection: &Detection) -> Sighting {
        let Detection { bev, covariance, .. } = detection;
        let (w, relative_w) = self.size_factor.apply(bev.w, covariance.ww);
        let (d, relative_d) = self.size_factor.apply(bev.d, covariance.dd);
        Sighting {
            z: Measurement {
                class: detection.class,
                position: [bev.x, bev.y],
                r: covariance.position,
                size: [w, d],
                relative_variance: [relative_w, relative_d],
                yaw: bev.yaw,
                yaw_variance: covariance.yaw,
                velocity: detection.velocity,
            },
            ln_detection_over_clutter: self.ln_detection_over_clutter,
            birth_odds: self.birth_odds,
        }
    }

    /// A frame as a look at everything that it does not report.
    pub fn look(&self, description: &SensorDescription, pose: Pose) -> Look {
        Look {
            pose,
            field_of_view: description.field_of_view,
            body: description.body,
            miss_probability: self.miss_probability,
        }
    }
}

impl SizeFactor {
    /// Moments of a normal of mean 1 and standard deviation σ, truncated below (Burkardt 2014, section 2.3).
    fn of(law: &SizeNoiseLaw) -> Self {
        let a = (law.lower - 1.0) / law.sigma;
        let density = libm::exp(-a * a / 2.0) / libm::sqrt(2.0 * PI);
        let kept = libm::erfc(a / libm::sqrt(2.0)) / 2.0;
        let hazard = density / kept;
        let mean = 1.0 + law.sigma * hazard;
        let variance = law.sigma * law.sigma * (1.0 + a * hazard - hazard * hazard);
        Self::Declared { mean, relative_variance: variance / (mean * mean) }
    }

    /// A reported size (m) with its variance (m²): debiased, and the variance relative to the true size.
    ///
    /// A report that states a much smaller error than the law (an agent's own, known body) keeps its own.
    fn apply(&self, reported: f64, variance: f64) -> (f64, f64) {
        let stated = variance / (reported * reported);
        match *self {
            Self::Declared { mean, relative_variance } if stated > relative_variance / 4.0 => {
                (reported / mean, relative_variance)
            }
            Self::Declared { .. } | Self::Undeclared => (reported, stated),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_laws_moments_are_those_of_the_truncated_normal() {
        // METHODS.md 12: mean and coefficient of variation of N1, N2, N3 with lower bound 0.1.
        for (sigma, mean, cv) in [(0.2, 1.000, 0.200), (0.5, 1.041, 0.442), (1.0, 1.326, 0.584)] {
            let SizeFactor::Declared { mean: m, relative_variance } =
                SizeFactor::of(&SizeNoiseLaw { sigma, lower: 0.1 })
            else {
                panic!("a law gives a declared factor");
            };
            assert!((m - mean).abs() < 1e-3, "mean {m} at sigma {sigma}");
            assert!((libm::sqrt(relative_variance) - cv).abs() < 1e-3, "cv at sigma {sigma}");
        }
    }

    #[test]
    fn without_clutter_the_first_report_is_certain() {
        let defaults = SensingDefaults { clutter_per_m2: 0.0, ..SensingDefaults::default() };
        let sensing = Sensing::undescribed(&defaults);
        let first = crate::track::Existence::from_odds(sensing.birth_odds);
        assert!(first.probability() > 0.99);
    }
}
