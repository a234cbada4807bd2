//! Width, depth and heading: three scalar filters.

use serde::{Deserialize, Serialize};
use v2x_common::geometry::{angle_difference, wrap_angle};

/// A width or a depth, m, estimated over time: a rigid body's size does not change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// Estimate, m.
    pub mean: f64,
    /// Variance, m².
    pub variance: f64,
}

impl Size {
    /// A first measurement (m) with its variance relative to the true size.
    #[inline]
    pub fn initial(z: f64, relative_variance: f64) -> Self {
        Self { mean: z, variance: relative_variance * z * z }
    }

    /// Predicts: a small diffusion (m²/s) keeps the estimate adaptive.
    #[inline]
    pub fn predict(&mut self, dt_s: f64, diffusion: f64) {
        self.variance += diffusion * dt_s.abs();
    }

    /// Updates by a measurement whose standard deviation is proportional to the true size.
    ///
    /// The proportion is taken of the estimate, not of the measurement: weighting by the measured size would
    /// favour what was measured too small (the relative information form).
    #[inline]
    pub fn update(&mut self, z: f64, relative_variance: f64) {
        let r = relative_variance * self.mean * self.mean;
        let gain = self.variance / (self.variance + r);
        self.mean += gain * (z - self.mean);
        self.variance *= 1.0 - gain;
    }

    /// Updates by a measurement of unknown correlation with the estimate: of one quantity,
    /// covariance intersection takes the more accurate one.
    pub fn intersect(&mut self, z: f64, relative_variance: f64) {
        let r = relative_variance * z * z;
        if r < self.variance {
            *self = Self { mean: z, variance: r };
        }
    }
}

/// A heading, rad, as a random walk on the circle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heading {
    /// Estimate, rad in (-π, π].
    pub mean: f64,
    /// Variance, rad².
    pub variance: f64,
}

impl Heading {
    /// A first measurement, rad and rad².
    #[inline]
    pub fn initial(z: f64, variance: f64) -> Self {
        Self { mean: wrap_angle(z), variance }
    }

    /// Predicts a random walk with this diffusion (rad²/s).
    #[inline]
    pub fn predict(&mut self, dt_s: f64, diffusion: f64) {
        self.variance += diffusion * dt_s.abs();
    }

    /// Updates by a measurement; the innovation is wrapped to [-π, π].
    #[inline]
    pub fn update(&mut self, z: f64, variance: f64) {
        let gain = self.variance / (self.variance + variance);
        self.mean = wrap_angle(self.mean + gain * angle_difference(z, self.mean));
        self.variance *= 1.0 - gain;
    }

    /// Updates by a measurement of unknown correlation with the estimate: the more accurate one holds.
    pub fn intersect(&mut self, z: f64, variance: f64) {
        if variance < self.variance {
            *self = Self::initial(z, variance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn equal_headings_on_both_sides_of_pi_average_to_pi() {
        let mut heading = Heading::initial(PI - 0.1, 0.01);
        heading.update(-PI + 0.1, 0.01);
        assert!((heading.mean.abs() - PI).abs() < 1e-12);
        assert!((heading.variance - 0.005).abs() < 1e-15);
    }

    #[test]
    fn small_and_large_measured_sizes_have_equal_weight() {
        let mut up = Size::initial(4.0, 0.04);
        up.update(6.0, 0.04);
        let mut down = Size::initial(4.0, 0.04);
        down.update(2.0, 0.04);
        assert!((up.mean - 5.0).abs() < 1e-12 && (down.mean - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_size_diffuses_with_time_in_either_direction() {
        for dt_s in [2.0, -2.0] {
            let mut size = Size { mean: 4.0, variance: 0.3 };
            size.predict(dt_s, 0.05);
            assert!(size.mean == 4.0 && (size.variance - 0.4).abs() < 1e-15);
            let mut heading = Heading { mean: 1.0, variance: 0.3 };
            heading.predict(dt_s, 0.05);
            assert!(heading.mean == 1.0 && (heading.variance - 0.4).abs() < 1e-15);
        }
    }

    #[test]
    fn an_updated_size_has_the_information_of_both() {
        let mut size = Size { mean: 5.0, variance: 0.5 };
        size.update(4.0, 0.04);
        // The measurement's variance is relative to the estimate: 0.04 of 25 m².
        assert!((size.variance - 1.0 / (1.0 / 0.5 + 1.0 / 1.0)).abs() < 1e-12);
        assert!((size.mean - (5.0 - 1.0 / 3.0)).abs() < 1e-12);
    }

    #[test]
    fn of_two_dependent_estimates_the_more_accurate_one_holds() {
        let start = Size { mean: 5.0, variance: 0.5 };
        let mut size = start;
        size.intersect(4.0, 0.04);
        assert_eq!(size, start, "a variance of 0.64 m² is larger");
        size.intersect(4.0, 0.03);
        assert!(size.mean == 4.0 && (size.variance - 0.48).abs() < 1e-12);
    }
}
