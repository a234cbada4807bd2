//! How much a class of object is expected to move: the prior of its motion.

use v2x_common::class::Class;

/// Process noise and velocity prior of the constant-velocity model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionParams {
    /// Spectral density of the acceleration on each axis, m²/s³.
    pub accel_psd: f64,
    /// Standard deviation of a new object's velocity on each axis, m/s.
    pub sigma_velocity_mps: f64,
    /// Diffusion of the heading, rad²/s.
    pub yaw_diffusion: f64,
    /// Diffusion of width and depth, m²/s.
    pub size_diffusion: f64,
}

/// A body's size does not change, but its projection to the plane may: 1 cm in a second.
const SIZE_DIFFUSION: f64 = 1e-4;

impl MotionParams {
    /// Of a class. Accelerations are those of everyday traffic (braking 1-3 m/s² for a second or two;
    /// Bokare & Maurya 2017), velocities those of cities; a turning vehicle's 0.3 rad/s is the heading's
    /// diffusion over half a second.
    #[inline]
    pub fn of(class: Class) -> Self {
        let (accel_psd, sigma_velocity_mps, yaw_diffusion) = if class.is_immobile() {
            (1e-4, 0.05, 1e-5)
        } else if class.is_pedestrian() || class == Class::Animal {
            (0.3, 1.4, 0.05)
        } else if class.is_two_wheeler() {
            (1.0, 4.0, 0.03)
        } else {
            (1.5, 7.0, 0.02)
        };
        Self { accel_psd, sigma_velocity_mps, yaw_diffusion, size_diffusion: SIZE_DIFFUSION }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    let params: Vec<_> = Class::ALL.iter().map(|class| (class.name(), MotionParams::of(*class))).collect();
    vec![("cv.motion", format!("{params:?}"))]
}
