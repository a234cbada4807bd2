//! Driving agents: around a block, once in each cycle of the light.

use std::f64::consts::PI;
use std::sync::Arc;

use v2x_common::time::Span;

use super::super::motion::Motion;
use super::super::path::Path;
use super::super::profile::{Profile, speed_change_distance_m};
use super::layout::{
    BRAKE_MPS2, LANE_M, QUEUE_GAP_M, RIGHT_TURN_RADIUS_M, SIDE_STREET_M, START_HEADWAY_S, START_MPS2,
    STOP_LINE_M, TURN_SPEED_MPS, in_arm,
};

/// Room that an agent takes in a queue: any car fits.
pub(super) const AGENT_LENGTH_M: f64 = 5.3;

/// From the stop line to the middle of the agent that waits at this place of the queue, m.
pub(super) fn queue_place_m(rank: usize) -> f64 {
    AGENT_LENGTH_M / 2.0 + rank as f64 * (AGENT_LENGTH_M + QUEUE_GAP_M)
}

/// The lap of the agent that waits `rank`-th at the arm's stop line: right through the crossing, and
/// right around the block to the arm again. Starts with the arm's phase.
pub(in super::super) fn block_lap(arm: u8, rank: usize, lap: Span) -> Motion {
    let light_phase_s = lap.as_secs_f64() / 5.0;
    let path = Arc::new(block(arm));
    let brake_m = speed_change_distance_m(TURN_SPEED_MPS, 0.0, BRAKE_MPS2);
    let moving = Profile::from(-queue_place_m(rank), 0.0)
        .change_speed(TURN_SPEED_MPS, START_MPS2)
        .cruise_to(path.length() - queue_place_m(rank) - brake_m)
        .change_speed(0.0, BRAKE_MPS2);
    let wait_s = lap.as_secs_f64() - moving.duration_s();
    let start_s = light_phase_s * f64::from(arm) + rank as f64 * START_HEADWAY_S;
    Motion::circling(&path, &Arc::new(moving.hold(wait_s)), start_s, lap)
}

/// From the arm's stop line around the block on its right and back to it.
fn block(arm: u8) -> Path {
    let (radius, side) = (RIGHT_TURN_RADIUS_M, SIDE_STREET_M - LANE_M);
    let to_turn = STOP_LINE_M - LANE_M - radius;
    Path::from(in_arm(arm, STOP_LINE_M, LANE_M, PI))
        .line(to_turn)
        .arc(-PI / 2.0, radius)
        .line(side - 2.0 * radius)
        .arc(-PI / 2.0, radius)
        .line(side - 2.0 * radius)
        .arc(-PI / 2.0, radius)
        .line(side - 2.0 * radius)
        .arc(-PI / 2.0, radius)
        .line(side - 2.0 * radius - to_turn)
        .close()
}
