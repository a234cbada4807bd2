//! The standard deviations of a sensor's measurements.

use v2x_common::covariance::{BoxCovariance, Covariance2};
use v2x_common::geometry::{BevBox, Pose};
use v2x_common::sensor::SizeNoiseLaw;

/// Errors of a sensor's measurements: σ_xy = `position_m` + `position_per_m` · range, σ_θ likewise, and
/// measured size = factor × true size with the factor from `size` (paper, section II).
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

    /// The covariance that the sensor reports with a measurement.
    ///
    /// It is computed from the *measured* range (from the estimated pose) and the *measured*
    /// size: from the true ones a receiver could compute the truth.
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
