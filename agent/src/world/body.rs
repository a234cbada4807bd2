//! Classes and sizes of objects.

use rand_chacha::ChaCha8Rng;
use v2x_common::class::Class;

use crate::random::truncated_normal;

/// Class, width and depth (m) of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    pub(super) class: Class,
    pub(super) w: f64,
    pub(super) d: f64,
}

impl Shape {
    /// A size around the class's typical one: relative σ by class, cut at two of them.
    pub(super) fn draw(class: Class, rng: &mut ChaCha8Rng) -> Self {
        let (w_spread, d_spread) = spreads(class);
        let (w, d) = class.typical_size();
        let mut factor =
            |spread: f64| truncated_normal(rng, 1.0, spread, (1.0 - 2.0 * spread, 1.0 + 2.0 * spread));
        Self { class, w: w * factor(w_spread), d: d * factor(d_spread) }
    }

    /// A vehicle agent is a car.
    pub(super) fn agent(rng: &mut ChaCha8Rng) -> Self {
        Self::draw(Class::Car, rng)
    }
}

/// Relative spreads of width and depth, 1 σ: vehicles vary little, other objects more.
const fn spreads(class: Class) -> (f64, f64) {
    match class {
        Class::Car | Class::PoliceCar | Class::Ambulance => (0.05, 0.08),
        Class::Truck | Class::Trailer | Class::ConstructionVehicle => (0.04, 0.15),
        Class::RigidBus | Class::BendyBus => (0.02, 0.06),
        Class::Barrier => (0.15, 0.10),
        _ => (0.10, 0.10),
    }
}
