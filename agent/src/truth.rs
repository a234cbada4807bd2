//! What only the simulation knows: true objects, and which detection came from which.
//!
//! None of it is on the detections' wire. It travels on its own key (`v2x/{network}/sim/truth`).

use serde::{Deserialize, Serialize};
use v2x_common::class::Class;
use v2x_common::geometry::BevBox;

/// Identity of a true object within one scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ObjectId(pub u32);

/// One object of the world at one time, in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueObject {
    /// Which one.
    pub id: ObjectId,
    /// What it is.
    pub class: Class,
    /// Where, how large (m), and which way (rad).
    pub bev: BevBox,
    /// Velocity east and north, m/s.
    pub velocity: (f64, f64),
}

/// The side table of one detection frame: whose detection stands at each index; `None` for clutter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identities {
    /// The agent's boot epoch.
    pub epoch: u64,
    /// The frame's number.
    pub sequence: u64,
    /// By index in the frame's list of detections.
    pub objects: Vec<Option<ObjectId>>,
}
