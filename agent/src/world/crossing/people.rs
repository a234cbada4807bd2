//! People on foot and on bicycles.

use std::f64::consts::PI;
use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use v2x_common::class::Class;
use v2x_common::time::Span;

use super::super::body::Shape;
use super::super::motion::Motion;
use super::super::path::Path;
use super::super::profile::{Profile, speed_change_distance_m};
use super::layout::{ARM_M, CYCLE_PATH_M, SIDE_STREET_M, SIDEWALK_M, STOP_LINE_M, in_arm};
use super::light::Light;
use crate::random::{Purpose, WorldDraw, keyed_rng, uniform, unit, weighted};

const WALK_MPS2: f64 = 1.0;
/// The phase of the light that belongs to people.
const PEOPLE_PHASE: u8 = 4;
/// Their phase begins with the last vehicles leaving the crossing.
const CLEARANCE_S: f64 = 3.5;
/// From the middle of the road to where people wait to cross it.
const KERB_M: f64 = 4.2;
/// People who cross a street turn back here at the latest, before the side streets.
const MAX_REACH_M: f64 = 38.0;
const U_TURN_RADIUS_M: f64 = 0.3;
/// From the middle of a side street to its sidewalk.
const SIDE_SIDEWALK_M: f64 = 6.4;
const CYCLE_MPS: f64 = 5.5;
const CYCLE_MPS2: f64 = 1.2;
const CYCLE_BRAKE_MPS2: f64 = 1.5;
/// Classes of people, by weight.
const CLASSES: [(Class, f64); 6] = [
    (Class::Adult, 80.0),
    (Class::Child, 8.0),
    (Class::ConstructionWorker, 3.0),
    (Class::PoliceOfficer, 2.0),
    (Class::PersonalMobility, 4.0),
    (Class::Stroller, 3.0),
];

/// People on foot. Of six, three cross a street, two walk around a block, one stands.
pub(super) fn pedestrians(count: u32, light: Light, loop_length: Span, seed: u64) -> Vec<(Shape, Motion)> {
    (0..count)
        .map(|number| {
            let mut rng = keyed_rng(seed, None, u64::from(number), Purpose::World(WorldDraw::Pedestrian));
            let shape = Shape::draw(weighted(&mut rng, &CLASSES), &mut rng);
            let motion = match number % 6 {
                0 | 2 | 4 => crossing_a_street(number / 2, light, &mut rng),
                1 | 3 => around_a_block(number / 6 * 2 + number % 6 / 2, loop_length, &mut rng),
                _ => standing(number / 6, &mut rng),
            };
            (shape, motion)
        })
        .collect()
}

/// Along a sidewalk, across the arm and back, each time in the people's phase. Takes two cycles.
fn crossing_a_street(number: u32, light: Light, rng: &mut ChaCha8Rng) -> Motion {
    let arm = quarter(number);
    let number_on_arm = number / 4;
    // Three lines beside each other, each walked in two phases.
    let out_m = SIDEWALK_M + 0.1 + f64::from(number_on_arm % 3) * 1.3;
    let first_cycle = f64::from(number_on_arm / 3 % 2);
    let speed_mps = uniform(rng, 1.1, 1.4);
    let walking_s = light.cycle_s() - uniform(rng, 5.0, 12.0);
    let reach_m = (speed_mps * walking_s / 2.0).min(MAX_REACH_M);
    let path = Path::from(in_arm(arm, out_m, -KERB_M, PI / 2.0))
        .line(reach_m + KERB_M)
        .arc(-PI, U_TURN_RADIUS_M)
        .line(2.0 * reach_m)
        .arc(-PI, U_TURN_RADIUS_M)
        .line(reach_m - KERB_M)
        .close();
    let brake_m = speed_change_distance_m(speed_mps, 0.0, WALK_MPS2);
    let mut profile = Profile::from(0.0, 0.0);
    // The way back is the way out rotated by half a turn: the same length.
    for n_crossings in [1.0, 2.0] {
        let stop_m = n_crossings * path.length() / 2.0;
        profile = profile
            .change_speed(speed_mps, WALK_MPS2)
            .cruise_to(stop_m - brake_m)
            .change_speed(0.0, WALK_MPS2);
        let wait_s = n_crossings * light.cycle_s() - profile.duration_s();
        profile = profile.hold(wait_s);
    }
    let period = Span::from_nanos(2 * light.cycle.as_nanos());
    let start_s = light.green_s(PEOPLE_PHASE) + CLEARANCE_S + first_cycle * light.cycle_s();
    Motion::circling(&path.into(), &Arc::new(profile), start_s, period)
}

/// In laps on the sidewalk of the block to the left of an arm, one or more laps in a loop.
fn around_a_block(number: u32, loop_length: Span, rng: &mut ChaCha8Rng) -> Motion {
    let arm = quarter(number);
    let ring_m = 0.8 * f64::from(number / 4 % 3);
    let inner_m = SIDEWALK_M + 4.0 + ring_m;
    let outer_m = SIDE_STREET_M - SIDE_SIDEWALK_M - ring_m;
    let (radius_m, side_m) = (1.0, outer_m - inner_m);
    let path = if unit(rng) < 0.5 {
        let start = in_arm(arm, outer_m - radius_m, inner_m, PI);
        Path::rounded_rectangle(start, (side_m, side_m), radius_m, -1.0)
    } else {
        let start = in_arm(arm, inner_m + radius_m, inner_m, 0.0);
        Path::rounded_rectangle(start, (side_m, side_m), radius_m, 1.0)
    };
    let loop_s = loop_length.as_secs_f64();
    let speed_mps = uniform(rng, 0.9, 1.5);
    let n_laps = libm::round(speed_mps * loop_s / path.length()).max(1.0);
    let profile = Profile::from(0.0, n_laps * path.length() / loop_s).hold(loop_s);
    let start_s = uniform(rng, 0.0, loop_s);
    Motion::circling(&path.into(), &Arc::new(profile), start_s, loop_length)
}

/// At rest, at a wall.
fn standing(number: u32, rng: &mut ChaCha8Rng) -> Motion {
    let side = if (number / 4).is_multiple_of(2) { 1.0 } else { -1.0 };
    let out_m = 16.0 + 5.0 * f64::from(number / 8 % 4) + uniform(rng, 0.0, 4.0);
    let left_m = side * (SIDEWALK_M + uniform(rng, 6.6, 7.4));
    Motion::Standing(in_arm(quarter(number), out_m, left_m, uniform(rng, -PI, PI)))
}

/// Arms in turn.
const fn quarter(number: u32) -> u8 {
    (number % 4) as u8
}

/// Bicycles on the cycle paths, straight across in the people's phase; `count` in each cycle.
pub(super) fn bicycles(count: u32, light: Light, loop_length: Span, seed: u64) -> Vec<(Shape, Motion)> {
    let mut population = Vec::new();
    for cycle in 0..light.n_cycles {
        for number in 0..count {
            let key = u64::from(cycle) * 1000 + u64::from(number);
            let mut rng = keyed_rng(seed, None, key, Purpose::World(WorldDraw::Bicycle));
            let arm = ((number + cycle) % 4) as u8;
            let place = number / 4;
            let shape = Shape::draw(Class::Bicycle, &mut rng);
            let path = Arc::new(Path::from(in_arm(arm, ARM_M, CYCLE_PATH_M, PI)).line(2.0 * ARM_M));
            let place_m = 1.2 + f64::from(place) * 2.8;
            let stop_m = ARM_M - STOP_LINE_M - place_m;
            let approach = Profile::from(0.0, CYCLE_MPS)
                .cruise_to(stop_m - speed_change_distance_m(CYCLE_MPS, 0.0, CYCLE_BRAKE_MPS2))
                .change_speed(0.0, CYCLE_BRAKE_MPS2);
            // Places further back in the queue arrive and start later.
            let wait_s = (10.0 - 1.5 * f64::from(place) + uniform(&mut rng, 0.0, 1.0)).max(0.5);
            let green_s = light.green_s(PEOPLE_PHASE) + CLEARANCE_S;
            let go_s = green_s + light.cycle_s() * f64::from(cycle) + f64::from(place) * 0.8;
            let start_s = go_s - wait_s - approach.duration_s();
            let profile = approach.hold(wait_s).change_speed(CYCLE_MPS, CYCLE_MPS2).cruise_to(path.length());
            population.push((shape, Motion::passing(&path, profile, start_s, loop_length)));
        }
    }
    population
}
