//! Classes and sizes of objects.

use rand_chacha::ChaCha8Rng;
use v2x_agent::random::{standard_normal, weighted};
use v2x_common::class::Class;

/// From the rear axle to the centre, as a share of a vehicle's length.
const AXLE_TO_CENTRE: f64 = 0.27;

/// A class and a size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Body {
    pub(super) class: Class,
    /// Width and depth, m.
    pub(super) size_m: [f64; 2],
}

/// Classes of driving vehicles, by weight.
const DRIVING: [(Class, f64); 8] = [
    (Class::Car, 84.0),
    (Class::Truck, 7.0),
    (Class::RigidBus, 2.5),
    (Class::BendyBus, 0.5),
    (Class::Motorcycle, 4.0),
    (Class::ConstructionVehicle, 1.0),
    (Class::PoliceCar, 0.6),
    (Class::Ambulance, 0.4),
];

/// Classes of parked vehicles, by weight.
const PARKED: [(Class, f64); 5] = [
    (Class::Car, 86.0),
    (Class::Truck, 6.0),
    (Class::Trailer, 3.0),
    (Class::Motorcycle, 3.0),
    (Class::ConstructionVehicle, 2.0),
];

/// Classes of pedestrians, by weight.
const WALKING: [(Class, f64); 7] = [
    (Class::Adult, 88.0),
    (Class::ConstructionWorker, 5.0),
    (Class::Child, 3.0),
    (Class::PoliceOfficer, 1.0),
    (Class::PersonalMobility, 1.0),
    (Class::Stroller, 1.0),
    (Class::Wheelchair, 1.0),
];

/// Mean width and depth, m, with the standard deviations of their logarithms. The means are the anchor sizes of published
/// detectors for nuScenes (OpenPCDet, cbgs configurations), not the engine's typical sizes. Classes without an anchor
/// have round numbers.
const fn sizes(class: Class) -> ([f64; 2], [f64; 2]) {
    match class {
        Class::Car | Class::PoliceCar => ([1.97, 4.63], [0.07, 0.09]),
        Class::Truck | Class::Ambulance => ([2.51, 6.93], [0.12, 0.25]),
        Class::RigidBus => ([2.94, 10.5], [0.06, 0.15]),
        Class::BendyBus => ([2.94, 17.5], [0.05, 0.08]),
        Class::Trailer => ([2.90, 12.29], [0.12, 0.25]),
        Class::ConstructionVehicle => ([2.85, 6.37], [0.18, 0.25]),
        Class::Motorcycle => ([0.77, 2.11], [0.18, 0.12]),
        Class::Bicycle => ([0.60, 1.70], [0.18, 0.10]),
        Class::Barrier => ([2.53, 0.50], [0.15, 0.18]),
        Class::TrafficCone => ([0.41, 0.41], [0.18, 0.18]),
        Class::PersonalMobility | Class::Stroller | Class::Wheelchair => ([0.65, 1.10], [0.12, 0.15]),
        Class::Child => ([0.50, 0.52], [0.12, 0.15]),
        Class::BicycleRack => ([2.2, 5.0], [0.2, 0.3]),
        _ => ([0.67, 0.73], [0.13, 0.18]),
    }
}

impl Body {
    /// A body of this class. Width and depth are correlated.
    pub(super) fn of(class: Class, rng: &mut ChaCha8Rng) -> Self {
        let (means, spreads) = sizes(class);
        let common = standard_normal(rng);
        let size_m = std::array::from_fn(|axis| {
            let own = standard_normal(rng);
            // Equal parts give a correlation of one half.
            let deviation = (common + own) / libm::sqrt(2.0);
            means[axis] * libm::exp(spreads[axis] * deviation.clamp(-2.5, 2.5))
        });
        Self { class, size_m }
    }

    pub(super) fn driving(rng: &mut ChaCha8Rng) -> Self {
        let class = weighted(rng, &DRIVING);
        Self::of(class, rng)
    }

    pub(super) fn parked(rng: &mut ChaCha8Rng) -> Self {
        let class = weighted(rng, &PARKED);
        Self::of(class, rng)
    }

    pub(super) fn walking(rng: &mut ChaCha8Rng) -> Self {
        let class = weighted(rng, &WALKING);
        Self::of(class, rng)
    }

    /// Distance from the rear axle to the centre, m. Pedestrians turn about their centre.
    pub(super) fn axle_to_centre_m(&self) -> f64 {
        if self.class.is_pedestrian() { 0.0 } else { AXLE_TO_CENTRE * self.size_m[1] }
    }
}
