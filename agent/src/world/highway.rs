//! A straight motorway along x with traffic in both directions, and service roads on which agents drive back.

use std::f64::consts::PI;
use std::sync::Arc;

use v2x_common::class::Class;
use v2x_common::geometry::{Pose, wrap_angle};
use v2x_common::time::Span;

use super::body::Shape;
use super::error::InvalidParameter;
use super::motion::Motion;
use super::path::Path;
use super::profile::{Profile, speed_change_distance_m};
use super::road::{Road, RoadKind};
use crate::random::{Purpose, WorldDraw, chance, keyed_rng, uniform, weighted};

/// Population of the motorway.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HighwayConfig {
    /// Share of the traffic's places that are occupied, 0 to 1; there is one every 2.5 s in each lane.
    pub traffic: f64,
    /// Vehicles that stand on the emergency lanes.
    pub parked: u32,
    /// Cones and barriers beside the emergency lanes.
    pub works: u32,
    /// Lanes in each direction, 1 to 4.
    pub lanes: u32,
}

impl Default for HighwayConfig {
    fn default() -> Self {
        Self { traffic: 0.5, parked: 6, works: 12, lanes: 3 }
    }
}

impl HighwayConfig {
    /// Checks every number.
    pub fn validate(&self) -> Result<(), InvalidParameter> {
        InvalidParameter::check_share("traffic", self.traffic)?;
        InvalidParameter::check_count("parked", self.parked, MAX_PARKED)?;
        InvalidParameter::check_count("works", self.works, MAX_WORKS)?;
        let lanes = self.lanes;
        InvalidParameter::check("lanes", &lanes, (1..=4).contains(&lanes), "1 to 4 (in each direction)")
    }
}

/// Most vehicles on the emergency lanes.
const MAX_PARKED: u32 = 40;
/// Most cones and barriers.
const MAX_WORKS: u32 = 200;

/// Where traffic enters and leaves, from the middle.
const ROAD_M: f64 = 450.0;
const LANE_WIDTH_M: f64 = 3.75;
/// From the middle of the motorway to the middle of the innermost lane.
const INNERMOST_M: f64 = 4.5;
/// Of the lanes, from the innermost to the outermost.
const SPEEDS_MPS: [f64; 4] = [34.0, 29.0, 24.0, 21.0];
/// Between two places of a lane's traffic; each vehicle comes up to 0.4 s early or late.
const HEADWAY_S: f64 = 2.5;
/// Middle of the agents' own lane, beyond four lanes: they enter and leave without obstructing traffic.
const AGENT_LANE_M: f64 = 20.0;
/// Middle of the emergency lane, beyond it.
const EMERGENCY_LANE_M: f64 = 23.8;
const WORKS_M: f64 = 26.5;
/// Vehicles and works stand no farther from the middle than this: beyond it the ramps cross their lane.
const STANDING_M: f64 = 260.0;
/// Half of the length on which agents drive along.
const SERVICE_HALF_M: f64 = 300.0;
/// Of the ramps' half circles; at [`RAMP_MPS`] 2.7 m/s² sideways.
const RAMP_RADIUS_M: f64 = 30.0;
const RAMP_MPS: f64 = 9.0;
const AGENT_MPS: f64 = 25.0;
const AGENT_MPS2: f64 = 2.0;
/// A lap of an agent takes about this long, and fits into the loop.
const LAP_S: f64 = 120.0;
/// Agents on one route follow each other at this part of a lap.
const AGENTS_PER_LAP: f64 = 4.0;
/// Classes in the outermost lane, by weight.
const SLOW_CLASSES: [(Class, f64); 4] =
    [(Class::Truck, 5.0), (Class::Trailer, 3.0), (Class::RigidBus, 1.0), (Class::Car, 4.0)];
/// Classes in the other lanes, by weight.
const FAST_CLASSES: [(Class, f64); 3] =
    [(Class::Car, 18.0), (Class::Motorcycle, 1.0), (Class::PoliceCar, 1.0)];

/// How long an agent's lap takes.
pub(super) fn lap_length(loop_length: Span) -> Span {
    let n_laps = libm::round(loop_length.as_secs_f64() / LAP_S).max(1.0);
    Span::from_secs_f64(loop_length.as_secs_f64() / n_laps)
}

/// Everything but the agents.
pub(super) fn population(config: &HighwayConfig, loop_length: Span, seed: u64) -> Vec<(Shape, Motion)> {
    let mut population = standing(config, seed);
    for side in 0..2 {
        for lane in 0..config.lanes {
            population.extend(lane_traffic(side, lane, config, loop_length, seed));
        }
    }
    population
}

/// A pose on one side of the motorway: along its direction of travel, and to the right of the middle.
fn on_side(side: u8, along_m: f64, right_m: f64, yaw: f64) -> Pose {
    let frame = Pose { x: 0.0, y: 0.0, yaw: if side == 0 { 0.0 } else { PI } };
    let (x, y) = frame.offset(along_m, -right_m);
    Pose { x, y, yaw: wrap_angle(frame.yaw + yaw) }
}

fn lane_traffic(
    side: u8,
    lane: u32,
    config: &HighwayConfig,
    loop_length: Span,
    seed: u64,
) -> Vec<(Shape, Motion)> {
    let right_m = INNERMOST_M + LANE_WIDTH_M * f64::from(lane);
    let path = Arc::new(Path::from(on_side(side, -ROAD_M, right_m, 0.0)).line(2.0 * ROAD_M));
    let outermost = lane + 1 == config.lanes;
    let speed_mps = SPEEDS_MPS[lane as usize];
    let n_places = libm::floor(loop_length.as_secs_f64() / HEADWAY_S);
    let step_s = loop_length.as_secs_f64() / n_places;
    let mut vehicles = Vec::new();
    let mut start_s = uniform(&mut lane_rng(seed, side, lane, u64::from(u32::MAX)), 0.0, step_s);
    for place in (0u32..).take_while(|place| f64::from(*place) < n_places) {
        let mut rng = lane_rng(seed, side, lane, u64::from(place));
        if chance(&mut rng, config.traffic) {
            let classes = if outermost && config.lanes > 1 { &SLOW_CLASSES[..] } else { &FAST_CLASSES[..] };
            let shape = Shape::draw(weighted(&mut rng, classes), &mut rng);
            let profile = Profile::from(0.0, speed_mps).cruise_to(path.length());
            let early_s = uniform(&mut rng, -0.4, 0.4);
            vehicles.push((shape, Motion::passing(&path, profile, start_s + early_s, loop_length)));
        }
        start_s += step_s;
    }
    vehicles
}

fn lane_rng(seed: u64, side: u8, lane: u32, place: u64) -> rand_chacha::ChaCha8Rng {
    let number = u64::from(side) << 48 | u64::from(lane) << 40 | place;
    keyed_rng(seed, None, number, Purpose::World(WorldDraw::Traffic))
}

/// Broken-down vehicles, cones and barriers beside the lanes.
fn standing(config: &HighwayConfig, seed: u64) -> Vec<(Shape, Motion)> {
    let vehicles = (0..config.parked).map(|number| {
        let mut rng = keyed_rng(seed, None, u64::from(number), Purpose::World(WorldDraw::Parked));
        let shape = Shape::draw(weighted(&mut rng, &SLOW_CLASSES), &mut rng);
        let (along_m, slot_m) = spread(number, config.parked);
        let along_m = along_m + uniform(&mut rng, -0.2, 0.2) * slot_m;
        let yaw = uniform(&mut rng, -0.03, 0.03);
        (shape, Motion::Standing(on_side((number % 2) as u8, along_m, EMERGENCY_LANE_M, yaw)))
    });
    let works = (0..config.works).map(|number| {
        let mut rng = keyed_rng(seed, None, u64::from(number), Purpose::World(WorldDraw::Works));
        let class = if number % 3 == 1 { Class::Barrier } else { Class::TrafficCone };
        let (along_m, _) = spread(number, config.works);
        let yaw = PI / 2.0 + uniform(&mut rng, -0.1, 0.1);
        (Shape::draw(class, &mut rng), Motion::Standing(on_side((number % 2) as u8, along_m, WORKS_M, yaw)))
    });
    vehicles.chain(works).collect()
}

/// The place of the `number`-th of `count` objects that alternate between the sides, and the length of road for it.
fn spread(number: u32, count: u32) -> (f64, f64) {
    let slot_m = 2.0 * STANDING_M / f64::from(count.div_ceil(2));
    (-STANDING_M + slot_m * (f64::from(number / 2) + 0.5), slot_m)
}

/// Both carriageways with their lanes, and the service roads with their ramps, as lines.
pub(super) fn roads(config: &HighwayConfig) -> Vec<Road> {
    let mut roads = Vec::new();
    for side in 0..2 {
        let line = |kind, width_m, right_m| {
            let [from, to] = [-ROAD_M, ROAD_M].map(|along_m| on_side(side, along_m, right_m, 0.0));
            Road::straight(kind, width_m, (from.x, from.y), (to.x, to.y))
        };
        // From the innermost lane's inner border to beyond the emergency lane.
        let (inner_m, outer_m) = (INNERMOST_M - LANE_WIDTH_M / 2.0, EMERGENCY_LANE_M + LANE_WIDTH_M / 2.0);
        roads.push(line(RoadKind::Surface, outer_m - inner_m, (inner_m + outer_m) / 2.0));
        for border in 0..=config.lanes {
            roads.push(line(RoadKind::Marking, 0.15, inner_m + LANE_WIDTH_M * f64::from(border)));
        }
        let path = service_path(side);
        let n_points = 120;
        let points = (0..=n_points).map(|k| {
            let pose = path.at(path.length() * f64::from(k) / f64::from(n_points));
            (pose.x, pose.y)
        });
        roads.push(Road { kind: RoadKind::Surface, width_m: LANE_WIDTH_M, points: points.collect() });
    }
    roads
}

/// Along the motorway, off to the right, back on the service road, and on again.
fn service_path(side: u8) -> Path {
    Path::from(on_side(side, -SERVICE_HALF_M, AGENT_LANE_M, 0.0))
        .line(2.0 * SERVICE_HALF_M)
        .arc(-PI, RAMP_RADIUS_M)
        .line(2.0 * SERVICE_HALF_M)
        .arc(-PI, RAMP_RADIUS_M)
        .close()
}

/// The lap of an agent: along the motorway, off to the right, back on the service road, and on again.
pub(super) fn service_lap(side: u8, rank: usize, lap: Span) -> Motion {
    let path = service_path(side);
    let (along_m, ramp_m) = (2.0 * SERVICE_HALF_M, PI * RAMP_RADIUS_M);
    let brake_m = speed_change_distance_m(AGENT_MPS, RAMP_MPS, AGENT_MPS2);
    let out = Profile::from(0.0, RAMP_MPS)
        .change_speed(AGENT_MPS, AGENT_MPS2)
        .cruise_to(along_m - brake_m)
        .change_speed(RAMP_MPS, AGENT_MPS2)
        .cruise_to(along_m + ramp_m);
    let ramp_s = ramp_m / RAMP_MPS;
    let back_s = lap.as_secs_f64() - out.duration_s() - ramp_s;
    let profile = back(out, along_m, back_s).hold(ramp_s);
    let start_s = lap.as_secs_f64() * rank as f64 / AGENTS_PER_LAP;
    Motion::circling(&path.into(), &Arc::new(profile), start_s, lap)
}

/// The length of the service road in exactly the time that is left: at the ramp's speed, with a middle part at
/// another speed `u`, with 1 m/s² between them: d = (t - 2|u-v|)·u + (u+v)·|u-v|, solved for u by bisection.
fn back(profile: Profile, along_m: f64, back_s: f64) -> Profile {
    let rate_mps2 = 1.0;
    let distance_m = |u: f64| {
        let change_s = (u - RAMP_MPS).abs() / rate_mps2;
        (back_s - 2.0 * change_s) * u + (u + RAMP_MPS) * change_s
    };
    let (mut slow, mut fast) = (0.5, AGENT_MPS);
    for _ in 0..60 {
        let middle = (slow + fast) / 2.0;
        if distance_m(middle) < along_m { slow = middle } else { fast = middle }
    }
    let speed_mps = (slow + fast) / 2.0;
    let change_s = (speed_mps - RAMP_MPS).abs() / rate_mps2;
    profile.change_speed(speed_mps, rate_mps2).hold(back_s - 2.0 * change_s).change_speed(RAMP_MPS, rate_mps2)
}
