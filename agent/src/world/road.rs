//! A line or an area on the ground, for pictures of a world. Nothing drives by it.

/// What a line on the ground is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RoadKind {
    /// A part of the ground, by its border: a crossing, a square.
    Area,
    /// Where vehicles drive or stand.
    Surface,
    /// The middle of a road, or the border of two lanes.
    Marking,
    /// Where traffic waits for the lights.
    StopLine,
}

/// A line on the ground, or an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Road {
    /// What it is.
    pub kind: RoadKind,
    /// Its width, m; 0 of an area.
    pub width_m: f64,
    /// Its middle, or an area's border without the first point again, in the map frame, m.
    pub points: Vec<(f64, f64)>,
}

impl Road {
    /// A straight line between two points, m.
    pub(super) fn straight(kind: RoadKind, width_m: f64, from: (f64, f64), to: (f64, f64)) -> Self {
        Self { kind, width_m, points: vec![from, to] }
    }
}
