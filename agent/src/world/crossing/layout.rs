//! Where the roads are. Distances are in metres.

use v2x_common::geometry::{Pose, wrap_angle};

/// Where traffic enters and leaves: farther from the middle than any route of agents is, by 60 m and more.
pub(super) const ARM_M: f64 = 150.0;
/// From the middle of the road to the middle of a lane.
pub(super) const LANE_M: f64 = 1.75;
/// From the middle of the road to the middle of the parking strip.
pub(super) const PARKING_M: f64 = 4.9;
/// From the middle of the road to the middle of the cycle path.
pub(super) const CYCLE_PATH_M: f64 = 6.75;
/// From the middle of the road to the inner edge of the sidewalk.
pub(super) const SIDEWALK_M: f64 = 7.6;
/// From the middle of the crossing to the stop line.
pub(super) const STOP_LINE_M: f64 = 12.0;
/// From the middle of the crossing to the middle of the side streets.
pub(super) const SIDE_STREET_M: f64 = 46.0;
/// Of right turns; at [`TURN_SPEED_MPS`] 2.9 m/s² sideways.
pub(super) const RIGHT_TURN_RADIUS_M: f64 = 8.5;
/// In the crossing, and of agents everywhere.
pub(super) const TURN_SPEED_MPS: f64 = 5.0;
/// Away from a red light.
pub(super) const START_MPS2: f64 = 1.8;
/// Towards a red light.
pub(super) const BRAKE_MPS2: f64 = 2.0;
/// Between the starts of two vehicles in a queue.
pub(super) const START_HEADWAY_S: f64 = 1.2;
/// Between two standing vehicles.
pub(super) const QUEUE_GAP_M: f64 = 2.0;
/// The frame of an arm: x out from the crossing along it, y to the left of that.
fn arm_frame(arm: u8) -> Pose {
    // Exact quarter turns: arms must not differ by a rounding of π.
    let yaw = [0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI, -std::f64::consts::FRAC_PI_2];
    Pose { x: 0.0, y: 0.0, yaw: yaw[usize::from(arm % 4)] }
}

/// A pose given in an arm's frame.
pub(super) fn in_arm(arm: u8, out_m: f64, left_m: f64, yaw: f64) -> Pose {
    let frame = arm_frame(arm);
    let (x, y) = frame.offset(out_m, left_m);
    Pose { x, y, yaw: wrap_angle(frame.yaw + yaw) }
}
