//! The streets as lines.

use super::layout::{ARM_M, LANE_M, PARKING_M, SIDE_STREET_M, STOP_LINE_M, in_arm};
use crate::world::road::{Road, RoadKind};

/// Of the two main streets with their parking strips, m.
const STREET_WIDTH_M: f64 = 2.0 * (PARKING_M + 1.2);
/// Of the one-way side streets with theirs, m.
const SIDE_WIDTH_M: f64 = 2.0 * 4.4;
const MARKING_WIDTH_M: f64 = 0.15;
const STOP_WIDTH_M: f64 = 0.5;
/// Markings end so far from the middle of the crossing.
const MARKED_FROM_M: f64 = STOP_LINE_M;

/// Two streets that cross, four side streets around, the middle of each arm and its stop line.
pub(in super::super) fn roads() -> Vec<Road> {
    let at = |arm, out_m, left_m| {
        let pose = in_arm(arm, out_m, left_m, 0.0);
        (pose.x, pose.y)
    };
    let mut roads = Vec::new();
    for arm in 0..4 {
        let line = |kind, width_m, from: (f64, f64), to: (f64, f64)| {
            Road::straight(kind, width_m, at(arm, from.0, from.1), at(arm, to.0, to.1))
        };
        roads.push(line(RoadKind::Surface, STREET_WIDTH_M, (0.0, 0.0), (ARM_M, 0.0)));
        let side_m = SIDE_STREET_M + SIDE_WIDTH_M / 2.0;
        roads.push(line(RoadKind::Surface, SIDE_WIDTH_M, (SIDE_STREET_M, -side_m), (SIDE_STREET_M, side_m)));
        roads.push(line(RoadKind::Marking, MARKING_WIDTH_M, (MARKED_FROM_M, 0.0), (ARM_M, 0.0)));
        // Traffic towards the crossing keeps to the right: to the left, seen from its middle.
        roads.push(line(RoadKind::StopLine, STOP_WIDTH_M, (STOP_LINE_M, 0.2), (STOP_LINE_M, 2.0 * LANE_M)));
    }
    roads
}
