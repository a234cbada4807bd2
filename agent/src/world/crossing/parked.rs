//! Objects at rest: parked vehicles, cones and barriers.

use std::f64::consts::PI;

use rand::seq::SliceRandom;
use v2x_common::class::Class;
use v2x_common::geometry::Pose;

use super::super::body::Shape;
use super::super::motion::Motion;
use super::layout::{PARKING_M, SIDE_STREET_M, in_arm};
use crate::random::{Purpose, WorldDraw, keyed_rng, uniform, weighted};

/// Parking places along the arms begin and end here, out from the middle of the crossing; not around the side streets.
const PARKING_OUT_M: [(f64, f64); 2] = [(19.0, 36.0), (58.0, 110.0)];
/// Room for one vehicle; longer ones do not park here.
const PLACE_M: f64 = 9.0;
/// From the middle of a one-way side street to its parking strips.
const SIDE_PARKING_M: f64 = 3.2;
/// Works stand in the parking strip of the eastern and western arm, on the right side when driving away from the crossing.
const WORKS_ARMS: [u8; 2] = [0, 2];
const WORKS_OUT_M: (f64, f64) = (24.0, 41.0);
const WORKS_STEP_M: f64 = 2.3;
/// Classes of parked vehicles, by weight.
const CLASSES: [(Class, f64); 6] = [
    (Class::Car, 76.0),
    (Class::Truck, 7.0),
    (Class::Motorcycle, 7.0),
    (Class::Bicycle, 6.0),
    (Class::ConstructionVehicle, 2.0),
    (Class::BicycleRack, 2.0),
];

/// Vehicles in parking places that are drawn without replacement.
pub(super) fn vehicles(count: u32, seed: u64) -> Vec<(Shape, Motion)> {
    let mut places = parking_places();
    places.shuffle(&mut keyed_rng(seed, None, 0, Purpose::World(WorldDraw::ParkingPlaces)));
    (0..u64::from(count))
        .zip(places)
        .map(|(number, place)| {
            let mut rng = keyed_rng(seed, None, number, Purpose::World(WorldDraw::Parked));
            let shape = Shape::draw(weighted(&mut rng, &CLASSES), &mut rng);
            // Parked by hand: not quite straight, not quite in the middle.
            let (x, y) = place.offset(uniform(&mut rng, -0.5, 0.5), uniform(&mut rng, -0.1, 0.1));
            let yaw = v2x_common::geometry::wrap_angle(place.yaw + uniform(&mut rng, -0.02, 0.02));
            (shape, Motion::Standing(Pose { x, y, yaw }))
        })
        .collect()
}

/// All places, in a fixed order: along the arms on both sides, and along the side streets.
fn parking_places() -> Vec<Pose> {
    let mut places = Vec::new();
    for arm in 0..4 {
        for (from_m, to_m) in PARKING_OUT_M {
            for out_m in centres(from_m, to_m) {
                places.push(in_arm(arm, out_m, PARKING_M, PI));
                if !(WORKS_ARMS.contains(&arm) && out_m < WORKS_OUT_M.1) {
                    places.push(in_arm(arm, out_m, -PARKING_M, 0.0));
                }
            }
        }
        // The side street across this arm, on both sides of it; it runs clockwise.
        for along_m in centres(17.0, 34.0).chain(centres(17.0, 34.0).map(|along_m| -along_m)) {
            for out_m in [SIDE_STREET_M - SIDE_PARKING_M, SIDE_STREET_M + SIDE_PARKING_M] {
                places.push(in_arm(arm, out_m, along_m, -PI / 2.0));
            }
        }
    }
    places
}

/// Middles of the places that fit between two points of a street.
fn centres(from_m: f64, to_m: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(from_m + PLACE_M / 2.0), |centre_m| Some(centre_m + PLACE_M))
        .take_while(move |centre_m| centre_m + PLACE_M / 2.0 <= to_m + 1.0)
}

/// Cones and barriers in rows beside the lane.
pub(super) fn works(count: u32, seed: u64) -> Vec<(Shape, Motion)> {
    (0..count)
        .map(|number| {
            let mut rng = keyed_rng(seed, None, u64::from(number), Purpose::World(WorldDraw::Works));
            let class = if number % 3 == 1 { Class::Barrier } else { Class::TrafficCone };
            let arm = WORKS_ARMS[(number % 2) as usize];
            let step = f64::from(number / 2);
            let row_steps = libm::floor((WORKS_OUT_M.1 - WORKS_OUT_M.0) / WORKS_STEP_M);
            let row = libm::floor(step / row_steps);
            let out_m = WORKS_OUT_M.0 + WORKS_STEP_M * (step - row * row_steps);
            let left_m = -(PARKING_M - 0.7 + 1.1 * row) + uniform(&mut rng, -0.1, 0.1);
            // A barrier's width is its long side: across the heading, so along the street.
            let yaw = PI / 2.0 + uniform(&mut rng, -0.1, 0.1);
            (Shape::draw(class, &mut rng), Motion::Standing(in_arm(arm, out_m, left_m, yaw)))
        })
        .collect()
}
