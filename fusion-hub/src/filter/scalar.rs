//! Width, depth and heading: three scalar filters.

use v2x_common::geometry::{angle_difference, wrap_angle};

/// A width or a depth, m, remembered over time: a rigid body's size does not change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Estimate, m.
    pub mean: f64,
    /// Variance, m².
    pub variance: f64,
}

impl Size {
    /// A first report (m) with its variance relative to the true size.
    #[inline]
    pub fn initial(z: f64, relative_variance: f64) -> Self {
        Self { mean: z, variance: relative_variance * z * z }
    }

    /// Lets the estimate age: a tiny diffusion (m²/s) keeps it open to change.
    #[inline]
    pub fn predict(&mut self, dt_s: f64, diffusion: f64) {
        self.variance += diffusion * dt_s.abs();
    }

    /// Takes in a report whose standard deviation is proportional to the true size.
    ///
    /// The proportion is taken of the estimate, not of the report: weighting by the reported size would
    /// favour what was measured too small (METHODS: the relative information form).
    #[inline]
    pub fn update(&mut self, z: f64, relative_variance: f64) {
        let r = relative_variance * self.mean * self.mean;
        let gain = self.variance / (self.variance + r);
        self.mean += gain * (z - self.mean);
        self.variance *= 1.0 - gain;
    }

    /// Takes in a report whose error may be correlated with the estimate's in any way: of one quantity,
    /// covariance intersection takes the better one.
    pub fn intersect(&mut self, z: f64, relative_variance: f64) {
        let r = relative_variance * z * z;
        if r < self.variance {
            *self = Self { mean: z, variance: r };
        }
    }
}

/// A heading, rad, as a random walk on the circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading {
    /// Estimate, rad in (-π, π].
    pub mean: f64,
    /// Variance, rad².
    pub variance: f64,
}

impl Heading {
    /// A first report, rad and rad².
    #[inline]
    pub fn initial(z: f64, variance: f64) -> Self {
        Self { mean: wrap_angle(z), variance }
    }

    /// Lets the heading wander with this diffusion (rad²/s).
    #[inline]
    pub fn predict(&mut self, dt_s: f64, diffusion: f64) {
        self.variance += diffusion * dt_s.abs();
    }

    /// Takes in a report; the innovation is the shorter way around.
    #[inline]
    pub fn update(&mut self, z: f64, variance: f64) {
        let gain = self.variance / (self.variance + variance);
        self.mean = wrap_angle(self.mean + gain * angle_difference(z, self.mean));
        self.variance *= 1.0 - gain;
    }

    /// Takes in a report whose error may be correlated with the estimate's in any way: the better one holds.
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
    fn two_equal_headings_across_the_seam_average_on_it() {
        let mut heading = Heading::initial(PI - 0.1, 0.01);
        heading.update(-PI + 0.1, 0.01);
        assert!((heading.mean.abs() - PI).abs() < 1e-12);
        assert!((heading.variance - 0.005).abs() < 1e-15);
    }

    #[test]
    fn small_and_large_reports_of_a_size_weigh_the_same() {
        let mut up = Size::initial(4.0, 0.04);
        up.update(6.0, 0.04);
        let mut down = Size::initial(4.0, 0.04);
        down.update(2.0, 0.04);
        assert!((up.mean - 5.0).abs() < 1e-12 && (down.mean - 3.0).abs() < 1e-12);
    }
}
