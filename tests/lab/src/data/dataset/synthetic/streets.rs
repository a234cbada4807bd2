//! A crossing of two roads: lanes and signal phases.

use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;
use v2x_agent::random::{uniform, weighted};
use v2x_agent::world::path::Path;
use v2x_common::geometry::Pose;

pub(super) const LANE_M: f64 = 3.5;
/// From the outer lane to the end of the crossing's corners, m.
const CORNER_M: f64 = 4.0;
/// Lanes begin this far before the crossing, m.
pub(super) const APPROACH_M: f64 = 250.0;
/// Lanes end this far after the crossing, m.
const EXIT_M: f64 = 400.0;

/// The phase of the signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// The main road drives.
    MainGreen,
    /// The crossing road drives.
    CrossGreen,
    /// Only agent 1's approach drives, and turns.
    OwnGreen,
    /// The main road waits, and starts after some seconds.
    MainStarts,
    /// The main road comes to a stop.
    MainStops,
}

/// The turn of a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    Left,
    Straight,
    Right,
}

/// The roads of a scene: the main road along x, the other one along y, crossing in the origin.
#[derive(Clone, Debug)]
pub(super) struct Streets {
    /// Number of lanes in each direction of both roads.
    n_lanes: [u32; 2],
    pub(super) phase: Phase,
}

/// One lane: the number of its approach (0 towards x, then counter-clockwise), its place from the middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Lane {
    pub(super) approach: u32,
    pub(super) place: u32,
}

impl Streets {
    pub(super) fn new(rng: &mut ChaCha8Rng) -> Self {
        let mut n = || weighted(rng, &[(1, 0.4), (2, 0.6)]);
        let n_lanes = [n(), n()];
        let phases = [
            (Phase::MainGreen, 0.45),
            (Phase::CrossGreen, 0.1),
            (Phase::OwnGreen, 0.1),
            (Phase::MainStarts, 0.2),
            (Phase::MainStops, 0.15),
        ];
        Self { n_lanes, phase: weighted(rng, &phases) }
    }

    pub(super) fn lanes(&self) -> impl Iterator<Item = Lane> {
        (0..4).flat_map(|approach| (0..self.lanes_of(approach)).map(move |place| Lane { approach, place }))
    }

    pub(super) fn lanes_of(&self, approach: u32) -> u32 {
        self.n_lanes[(approach % 2) as usize]
    }

    /// Distance from a road's middle to its kerb, m.
    pub(super) fn kerb_m(&self, approach: u32) -> f64 {
        LANE_M * f64::from(self.lanes_of(approach))
    }

    /// Distance from the crossing's middle to the end of an approach, m.
    pub(super) fn junction_m(&self, approach: u32) -> f64 {
        self.kerb_m(approach + 1) + CORNER_M
    }

    /// Position of the stop line along the path of a lane, m.
    pub(super) fn stop_line_m(&self, lane: Lane) -> f64 {
        APPROACH_M - self.junction_m(lane.approach) - 1.0
    }

    /// The path of a lane.
    pub(super) fn path(&self, lane: Lane, turn: Turn) -> Path {
        let aside_m = LANE_M * (f64::from(lane.place) + 0.5);
        let junction_m = self.junction_m(lane.approach);
        let start = rotated(-APPROACH_M, -aside_m, lane.approach);
        let approach = Path::from(start).line(APPROACH_M - junction_m);
        match turn {
            Turn::Straight => approach.line(EXIT_M),
            // Into the innermost and the outermost lane of the other road.
            Turn::Left => approach.arc(PI / 2.0, junction_m + LANE_M / 2.0).line(EXIT_M),
            Turn::Right => approach.arc(-PI / 2.0, CORNER_M + LANE_M / 2.0).line(EXIT_M),
        }
    }
}

/// A pose heading along an approach, from coordinates along and to the left of it.
pub(super) fn rotated(along_m: f64, left_m: f64, approach: u32) -> Pose {
    let frame = Pose { x: 0.0, y: 0.0, yaw: PI / 2.0 * f64::from(approach) };
    let (x, y) = frame.offset(along_m, left_m);
    Pose { x, y, yaw: frame.yaw }
}

/// A uniform length between two.
pub(super) fn between(rng: &mut ChaCha8Rng, (low, high): (f64, f64)) -> f64 {
    uniform(rng, low, high)
}
