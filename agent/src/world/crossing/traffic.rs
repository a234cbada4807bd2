//! Vehicles that arrive on an arm, wait at the light, and go straight on or turn.

use std::f64::consts::PI;
use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use v2x_common::class::Class;
use v2x_common::time::Span;

use super::super::body::Shape;
use super::super::motion::Motion;
use super::super::path::Path;
use super::super::profile::{Profile, speed_change_distance_m};
use super::agents::AGENT_LENGTH_M;
use super::layout::{
    ARM_M, BRAKE_MPS2, LANE_M, QUEUE_GAP_M, RIGHT_TURN_RADIUS_M, START_HEADWAY_S, START_MPS2, STOP_LINE_M,
    TURN_SPEED_MPS, in_arm,
};
use super::light::Light;
use crate::random::{Purpose, WorldDraw, chance, keyed_rng, uniform, weighted};

/// Places in an arm's queue.
const QUEUE_PLACES: u32 = 4;
const CRUISE_MPS: f64 = 10.0;
const LEFT_TURN_RADIUS_M: f64 = 9.0;
/// Vehicles speed up again when they are this far beyond the stop line: every turn is over.
const TURN_DISTANCE_M: f64 = 24.0;
const SPEED_UP_MPS2: f64 = 1.5;
/// The last vehicle of a phase passes the stop line at least this long before its end.
const CLEARANCE_S: f64 = 1.5;
/// Other vehicles arrive in the lane this long after the agents that turn into it from a side street.
const AFTER_AGENTS_S: f64 = 5.0;
/// Classes of traffic, by weight.
const CLASSES: [(Class, f64); 9] = [
    (Class::Car, 74.0),
    (Class::Truck, 8.0),
    (Class::RigidBus, 4.0),
    (Class::Motorcycle, 7.0),
    (Class::BendyBus, 1.0),
    (Class::ConstructionVehicle, 1.0),
    (Class::Ambulance, 1.0),
    (Class::PoliceCar, 2.0),
    (Class::Trailer, 2.0),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    Straight,
    Left,
    Right,
}

/// The traffic of all arms in all cycles of the loop; `share` of the places are taken.
pub(super) fn traffic(
    share: f64,
    light: Light,
    loop_length: Span,
    queued_agents: &[usize; 4],
    seed: u64,
) -> Vec<(Shape, Motion)> {
    let mut population = Vec::new();
    for (arm, n_agents) in (0u8..).zip(queued_agents) {
        let paths = [Turn::Straight, Turn::Left, Turn::Right].map(|turn| (turn, Arc::new(path(arm, turn))));
        for cycle in 0..light.n_cycles {
            let mut queue = Queue::behind(*n_agents, light);
            for place in 0..QUEUE_PLACES {
                let number = u64::from((cycle * 4 + u32::from(arm)) * QUEUE_PLACES + place);
                let mut rng = keyed_rng(seed, None, number, Purpose::World(WorldDraw::Traffic));
                if !chance(&mut rng, share) || place < *n_agents as u32 {
                    continue;
                }
                let shape = Shape::draw(weighted(&mut rng, &CLASSES), &mut rng);
                let turn = turn(shape.class, *n_agents > 0, &mut rng);
                let Some((profile, start_s)) = queue.join(shape.d, &mut rng) else { continue };
                let path = &paths.iter().find(|(known, _)| *known == turn).expect("all turns have paths").1;
                let green_s = light.green_s(arm) + light.cycle_s() * f64::from(cycle);
                let profile = profile.cruise_to(path.length());
                population.push((shape, Motion::passing(path, profile, green_s + start_s, loop_length)));
            }
        }
    }
    population
}

/// Long vehicles go straight on. No vehicle turns right behind an agent, which takes that turn slowly.
fn turn(class: Class, behind_agents: bool, rng: &mut ChaCha8Rng) -> Turn {
    let turn = weighted(rng, &[(Turn::Straight, 2.0), (Turn::Left, 1.0), (Turn::Right, 1.0)]);
    match class {
        Class::RigidBus | Class::BendyBus | Class::Truck | Class::Trailer => Turn::Straight,
        _ if turn == Turn::Right && behind_agents => Turn::Left,
        _ => turn,
    }
}

/// A queue in front of the stop line.
struct Queue {
    /// From the stop line to the end of the last vehicle and the gap behind it.
    length_m: f64,
    n_waiting: u32,
    /// When the last vehicle came to rest, relative to the phase's beginning.
    last_arrival_s: f64,
    green_s: f64,
}

impl Queue {
    fn behind(n_agents: usize, light: Light) -> Self {
        // Agents wait since the end of their lap; other vehicles arrive after them.
        let earliest_s = if n_agents > 0 { -15.0 + AFTER_AGENTS_S } else { -15.0 };
        Self {
            length_m: n_agents as f64 * (AGENT_LENGTH_M + QUEUE_GAP_M),
            n_waiting: n_agents as u32,
            last_arrival_s: earliest_s,
            green_s: light.phase_s(),
        }
    }

    /// Adds a vehicle of this length (m). Returns its ride to the other side of the crossing, and the start of the ride
    /// relative to the beginning of the phase; `None` if it would not pass the stop line in this phase.
    fn join(&mut self, length_m: f64, rng: &mut ChaCha8Rng) -> Option<(Profile, f64)> {
        let place_m = self.length_m + length_m / 2.0;
        let go_s = f64::from(self.n_waiting) * START_HEADWAY_S;
        let arrival_s = self.last_arrival_s + uniform(rng, 0.8, 4.0);
        let passes_s = go_s + place_m / TURN_SPEED_MPS + TURN_SPEED_MPS / (2.0 * START_MPS2);
        if passes_s > self.green_s - CLEARANCE_S || arrival_s > go_s {
            return None;
        }
        self.length_m += length_m + QUEUE_GAP_M;
        self.n_waiting += 1;
        self.last_arrival_s = arrival_s;
        let stop_m = ARM_M - STOP_LINE_M - place_m;
        let approach = Profile::from(0.0, CRUISE_MPS)
            .cruise_to(stop_m - speed_change_distance_m(CRUISE_MPS, 0.0, BRAKE_MPS2))
            .change_speed(0.0, BRAKE_MPS2);
        let start_s = arrival_s - approach.duration_s();
        let ride = approach
            .hold(go_s - arrival_s)
            .change_speed(TURN_SPEED_MPS, START_MPS2)
            .cruise_to(ARM_M - STOP_LINE_M + TURN_DISTANCE_M)
            .change_speed(CRUISE_MPS, SPEED_UP_MPS2);
        Some((ride, start_s))
    }
}

fn path(arm: u8, turn: Turn) -> Path {
    let path = Path::from(in_arm(arm, ARM_M, LANE_M, PI));
    match turn {
        Turn::Straight => path.line(2.0 * ARM_M),
        Turn::Left => {
            let straight_m = ARM_M - (LEFT_TURN_RADIUS_M - LANE_M);
            path.line(straight_m).arc(PI / 2.0, LEFT_TURN_RADIUS_M).line(straight_m)
        }
        Turn::Right => {
            let straight_m = ARM_M - (RIGHT_TURN_RADIUS_M + LANE_M);
            path.line(straight_m).arc(-PI / 2.0, RIGHT_TURN_RADIUS_M).line(straight_m)
        }
    }
}
