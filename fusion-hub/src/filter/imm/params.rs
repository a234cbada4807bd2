//! How each class of object moves (deploy/docs/methods.md), with all noise as densities over time.

use super::gaussian::Motion;
use super::motion::{Drive, Rest};
use v2x_common::class::Class;

/// What is assumed of an object at its first measurement (the birth model).
#[derive(Clone, Copy, Debug)]
pub(super) struct Birth {
    /// Probabilities of the models.
    pub(super) weights: [f64; 4],
    /// How it moves if it does.
    pub(super) motion: Motion,
    /// The manoeuvring model takes the unusual speeds, too: three times the spread.
    ///
    /// With a city's 6 ± 3.6 m/s alone the gate would lose a car on a motorway.
    pub(super) unusual: Motion,
}

/// All of a class.
#[derive(Clone, Copy, Debug)]
pub(super) struct Params {
    pub(super) birth: Birth,
    /// How it moves when it starts.
    pub(super) start: Motion,
    pub(super) still: Rest,
    pub(super) smooth: Drive,
    pub(super) manoeuvre: Drive,
    /// Distance from the rear axle to the centre, over the length.
    pub(super) lever: f64,
}

const fn motion(speed: f64, sigma_speed: f64, sigma_turn: f64) -> Motion {
    Motion { speed, speed_variance: sigma_speed * sigma_speed, turn_variance: sigma_turn * sigma_turn }
}

const fn birth(moving: f64, parked_share: f64, motion: Motion) -> Birth {
    let still = 1.0 - moving;
    let weights = [still * parked_share, still * (1.0 - parked_share), 0.8 * moving, 0.2 * moving];
    let unusual = Motion { speed_variance: 9.0 * motion.speed_variance, ..motion };
    Birth { weights, motion, unusual }
}

const VEHICLE: Params = Params {
    birth: birth(0.4, 0.9, motion(6.0, 3.6, 0.04)),
    start: motion(0.7, 0.7, 0.04),
    still: Rest::per_half_second(0.02, 0.04),
    smooth: Drive::smooth(0.3, 0.005, 0.03, 0.03, 0.2),
    manoeuvre: Drive::manoeuvre(3.0, 0.08, 0.3, 0.2, 1.5),
    lever: 0.27,
};

const PEDESTRIAN: Params = Params {
    birth: birth(0.75, 0.7, motion(1.2, 0.4, 0.06)),
    start: motion(0.6, 0.4, 0.06),
    still: Rest::per_half_second(0.02, 0.4),
    smooth: Drive::smooth(0.12, 0.01, 0.03, 0.03, 0.5),
    manoeuvre: Drive::manoeuvre(0.9, 0.16, 0.25, 0.16, 9.0),
    lever: 0.0,
};

/// 0.01 rad, in degrees.
const CENTIRADIAN: f64 = 0.01 * 180.0 / std::f64::consts::PI;

const IMMOBILE: Params = Params {
    birth: birth(0.0, 1.0, motion(0.1, 0.1, 0.05)),
    start: motion(0.1, 0.1, 0.05),
    // As of a parked car: the table's 5 mm and 0.01 degrees give too small covariances (NEES 2.6 at 10 Hz).
    still: Rest::per_half_second(0.02, 0.04),
    smooth: Drive::smooth(0.1, 0.005, 0.01, 0.01, CENTIRADIAN),
    manoeuvre: Drive::manoeuvre(0.1, 0.01, 0.01, 0.01, CENTIRADIAN),
    lever: 0.0,
};

const fn vehicle(birth: Birth) -> Params {
    Params { birth, ..VEHICLE }
}

const BUS_OR_MOTORCYCLE: Params = vehicle(birth(0.6, 0.9, VEHICLE.birth.motion));
const BICYCLE: Params = vehicle(birth(0.3, 0.9, motion(4.0, 1.6, 0.04)));
const TRAILER: Params = vehicle(birth(0.3, 0.9, VEHICLE.birth.motion));
const CONSTRUCTION: Params = vehicle(birth(0.15, 0.9, motion(2.0, 1.6, 0.04)));

/// Classes that move alike are one kind.
static KINDS: [Params; 7] =
    [VEHICLE, BUS_OR_MOTORCYCLE, PEDESTRIAN, BICYCLE, TRAILER, CONSTRUCTION, IMMOBILE];

impl Params {
    /// Of a class.
    pub(super) fn of(class: Class) -> &'static Self {
        &KINDS[Self::kind_of(class)]
    }

    /// Of all kinds of classes.
    pub(super) fn of_kinds() -> impl Iterator<Item = &'static Self> {
        KINDS.iter()
    }

    /// Which kind a class is of, by its place in [`Self::of_kinds`].
    pub(super) const fn kind_of(class: Class) -> usize {
        match class {
            Class::BendyBus | Class::RigidBus | Class::Motorcycle => 1,
            Class::Animal => 2,
            Class::Bicycle => 3,
            Class::Trailer => 4,
            Class::ConstructionVehicle => 5,
            _ if class.is_immobile() => 6,
            _ if class.is_pedestrian() => 2,
            _ => 0,
        }
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(in crate::filter) fn listed() -> Vec<(&'static str, String)> {
    let classes = [
        ("imm.vehicle", VEHICLE),
        ("imm.pedestrian", PEDESTRIAN),
        ("imm.immobile", IMMOBILE),
        ("imm.bus_or_motorcycle", BUS_OR_MOTORCYCLE),
        ("imm.bicycle", BICYCLE),
        ("imm.trailer", TRAILER),
        ("imm.construction", CONSTRUCTION),
    ];
    classes.map(|(name, params)| (name, format!("{params:?}"))).into()
}
