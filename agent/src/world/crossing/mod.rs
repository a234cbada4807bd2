//! Two roads that cross, with a fixed-time traffic light, and four blocks around.
//!
//! Each arm of the crossing has one lane in and one out, parking strips, cycle paths and sidewalks. One-way side
//! streets make a square around the crossing: on them, and on the arms, agents drive around a block.
//! In each cycle of the light each arm has one phase for itself (east, north, west, south), and a fifth
//! belongs to bicycles and people on foot: so no two routes are in conflict. Within a lane all vehicles have the same
//! speed profile, shifted in time and place: so they do not collide.

mod agents;
mod layout;
mod light;
mod parked;
mod people;
mod roads;
mod traffic;

use v2x_common::time::Span;

use super::body::Shape;
use super::error::InvalidParameter;
use super::motion::Motion;
use light::Light;

pub(super) use agents::block_lap;
pub(super) use roads::roads;

/// Population of the crossing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingConfig {
    /// Share of the traffic's places that are occupied, 0 to 1; there are four in each arm and cycle of the light.
    pub traffic: f64,
    /// Vehicles parked along the streets.
    pub parked: u32,
    /// Cones and barriers.
    pub works: u32,
    /// People on foot: half of them cross a street, a third walk around a block, the rest stand.
    pub pedestrians: u32,
    /// Bicycles in each cycle of the light.
    pub bicycles: u32,
}

impl Default for CrossingConfig {
    /// About 25 boxes within 60 m of the crossing, about 30 % of them in motion.
    fn default() -> Self {
        Self { traffic: 0.55, parked: 22, works: 6, pedestrians: 6, bicycles: 1 }
    }
}

/// Most vehicles that find a parking place.
const MAX_PARKED: u32 = 120;
/// Most cones and barriers for which there is room.
const MAX_WORKS: u32 = 28;
/// Most people on foot: with more of them, two would share a line across a street.
const MAX_PEDESTRIANS: u32 = 48;
/// Most bicycles in a cycle: two behind each other in each arm (a third would meet agents at the side streets).
const MAX_BICYCLES: u32 = 8;

impl CrossingConfig {
    /// Checks every number.
    pub fn validate(&self) -> Result<(), InvalidParameter> {
        InvalidParameter::check_share("traffic", self.traffic)?;
        InvalidParameter::check_count("parked", self.parked, MAX_PARKED)?;
        InvalidParameter::check_count("works", self.works, MAX_WORKS)?;
        InvalidParameter::check_count("pedestrians", self.pedestrians, MAX_PEDESTRIANS)?;
        InvalidParameter::check_count("bicycles", self.bicycles, MAX_BICYCLES)
    }
}

/// How long an agent's lap around a block takes: one cycle of the light.
pub(super) fn lap_length(loop_length: Span) -> Span {
    Light::new(loop_length).cycle
}

/// Everything but the agents. Arms where agents wait leave them the first places in the queue.
pub(super) fn population(
    config: &CrossingConfig,
    loop_length: Span,
    queued_agents: &[usize; 4],
    seed: u64,
) -> Vec<(Shape, Motion)> {
    let light = Light::new(loop_length);
    let mut population = parked::works(config.works, seed);
    population.extend(parked::vehicles(config.parked, seed));
    population.extend(people::pedestrians(config.pedestrians, light, loop_length, seed));
    population.extend(people::bicycles(config.bicycles, light, loop_length, seed));
    population.extend(traffic::traffic(config.traffic, light, loop_length, queued_agents, seed));
    population
}
