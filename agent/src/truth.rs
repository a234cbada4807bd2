//! Ground truth, which only the simulation knows: true objects, and the identities of detections.
//!
//! It is not in detection frames, but published under its own key (`v2x/{network}/sim/truth`).

use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::geometry::BevBox;

/// Identity of a true object within one scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ObjectId(pub u32);

/// One object of the world at one time, in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueObject {
    /// Its identity.
    pub id: ObjectId,
    /// Its class.
    pub class: Class,
    /// Position (m), size (m) and heading (rad).
    pub bev: BevBox,
    /// Velocity east and north, m/s.
    pub velocity: (f64, f64),
}

/// The identities of the detections of one frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identities {
    /// The agent's boot epoch.
    pub epoch: u64,
    /// The frame's number.
    pub sequence: u64,
    /// The true object of the detection at each index of the frame; `None` for clutter.
    pub objects: Vec<Option<ObjectId>>,
}
