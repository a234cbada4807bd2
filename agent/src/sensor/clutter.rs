//! False detections.

use std::f64::consts::{PI, TAU};

use rand_chacha::ChaCha8Rng;
use v2x_common::class::Class;
use v2x_common::geometry::{BevBox, Pose, wrap_angle};

use super::config::SensorConfig;
use crate::random::{poisson, truncated_normal, uniform, unit, weighted};

/// Classes of false detections, by weight.
const CLASSES: [(Class, f64); 6] = [
    (Class::Car, 5.0),
    (Class::Adult, 2.0),
    (Class::TrafficCone, 1.0),
    (Class::Barrier, 1.0),
    (Class::Bicycle, 0.5),
    (Class::Truck, 0.5),
];

/// A Poisson number of boxes, uniform over the field of view of a sensor at `pose`.
pub(super) fn draw(config: &SensorConfig, pose: &Pose, rng: &mut ChaCha8Rng) -> Vec<(Class, BevBox)> {
    let count = poisson(rng, config.clutter_per_frame);
    (0..count).map(|_| draw_one(config, pose, rng)).collect()
}

fn draw_one(config: &SensorConfig, pose: &Pose, rng: &mut ChaCha8Rng) -> (Class, BevBox) {
    let fov = &config.field_of_view;
    let (near2, far2) = (fov.range_min_m * fov.range_min_m, fov.range_max_m * fov.range_max_m);
    let range_m = libm::sqrt(uniform(rng, near2, far2));
    let bearing = fov.azimuth_rad + (unit(rng) - 0.5) * fov.width_rad;
    let (sin, cos) = libm::sincos(bearing);
    let (x, y) = pose.offset(range_m * cos, range_m * sin);
    let class = weighted(rng, &CLASSES);
    let (w, d) = class.typical_size();
    let law = &config.noise.size;
    let mut factor = || truncated_normal(rng, 1.0, law.sigma, (law.lower, 5.0));
    let (w, d) = (w * factor(), d * factor());
    (class, BevBox { x, y, w, d, yaw: wrap_angle(uniform(rng, -PI, TAU - PI)) })
}
