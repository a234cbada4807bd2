//! Two roads that cross, with a fixed-time traffic light, and four blocks around.
//!
//! Each arm of the crossing has one lane in and one out, parking strips, cycle paths and sidewalks. One-way side
//! streets make a square around the crossing: on them, and on the arms, agents drive around a block.
//! In each cycle of the light each arm has one phase for itself (east, north, west, south), and a fifth
//! belongs to bicycles and people on foot: so no two routes conflict, whoever turns where.
//! Within a lane all ride by the same profile, shifted in time and place: so none runs into another.

mod agents;
mod parked;
mod people;
mod traffic;

use v2x_common::geometry::Pose;
use v2x_common::time::Span;

use super::body::Shape;
use super::motion::Motion;

pub(super) use agents::block_lap;

/// The knobs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingConfig {
    /// Share of the traffic's places that are taken, 0 to 1; all of them are four vehicles in each arm and cycle.
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
pub const MAX_PARKED: u32 = 120;
/// Most cones and barriers for which there is room.
pub const MAX_WORKS: u32 = 28;
/// Most people on foot: with more of them, two would share a line across a street.
pub const MAX_PEDESTRIANS: u32 = 48;
/// Most bicycles in a cycle: two behind each other in each arm (a third would meet agents at the side streets).
pub const MAX_BICYCLES: u32 = 8;

/// Where traffic enters and leaves: farther from the middle than any route of agents is, by 60 m and more.
const ARM_M: f64 = 150.0;
/// From the middle of the road to the middle of a lane.
const LANE_M: f64 = 1.75;
/// From the middle of the road to the middle of the parking strip.
const PARKING_M: f64 = 4.9;
/// From the middle of the road to the middle of the cycle path.
const CYCLE_PATH_M: f64 = 6.75;
/// From the middle of the road to the inner edge of the sidewalk.
const SIDEWALK_M: f64 = 7.6;
/// From the middle of the crossing to the stop line.
const STOP_LINE_M: f64 = 12.0;
/// From the middle of the crossing to the middle of the side streets.
const SIDE_STREET_M: f64 = 46.0;
/// Of right turns; at [`TURN_SPEED_MPS`] 2.9 m/s² sideways.
const RIGHT_TURN_RADIUS_M: f64 = 8.5;
/// In the crossing, and of agents everywhere.
const TURN_SPEED_MPS: f64 = 5.0;
/// Away from a red light.
const START_MPS2: f64 = 1.8;
/// Towards a red light.
const BRAKE_MPS2: f64 = 2.0;
/// Between the starts of two vehicles in a queue.
const START_HEADWAY_S: f64 = 1.2;
/// Between two standing vehicles.
const QUEUE_GAP_M: f64 = 2.0;
/// A cycle is about this long, and fits an even number of times into the loop.
const CYCLE_S: f64 = 60.0;

/// Period of the traffic light.
#[derive(Clone, Copy, Debug)]
struct Light {
    cycle: Span,
    n_cycles: u32,
}

impl Light {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "loops are at most an hour")]
    fn new(loop_length: Span) -> Self {
        let n_pairs = libm::round(loop_length.as_secs_f64() / (2.0 * CYCLE_S)).max(1.0) as u32;
        let n_cycles = 2 * n_pairs;
        Self { cycle: Span::from_nanos(loop_length.as_nanos() / i64::from(n_cycles)), n_cycles }
    }

    fn cycle_s(self) -> f64 {
        self.cycle.as_secs_f64()
    }

    fn phase_s(self) -> f64 {
        self.cycle_s() / 5.0
    }

    /// When the arm's phase begins in the first cycle; phase 4 is that of bicycles and people on foot.
    fn green_s(self, phase: u8) -> f64 {
        self.phase_s() * f64::from(phase)
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
    population.extend(traffic::traffic(config.traffic, light, loop_length, (queued_agents, seed)));
    population
}

/// The frame of an arm: x out from the crossing along it, y to the left of that.
fn arm_frame(arm: u8) -> Pose {
    // Exact quarter turns: arms must not differ by a rounding of π.
    let yaw = [0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI, -std::f64::consts::FRAC_PI_2];
    Pose { x: 0.0, y: 0.0, yaw: yaw[usize::from(arm % 4)] }
}

/// A pose given in an arm's frame.
fn in_arm(arm: u8, out_m: f64, left_m: f64, yaw: f64) -> Pose {
    let frame = arm_frame(arm);
    let (x, y) = frame.offset(out_m, left_m);
    Pose { x, y, yaw: v2x_common::geometry::wrap_angle(frame.yaw + yaw) }
}
