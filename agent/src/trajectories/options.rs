//! What to read of a recording, and how.

use std::collections::BTreeMap;
use v2x_common::class::Class;

/// What to read, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadOptions {
    /// The first time to keep, s since the file's earliest.
    pub from_s: Option<f64>,
    /// The last time to keep, s since the file's earliest.
    pub to_s: Option<f64>,
    /// The file's earliest time, s, where it is known not to be that of its first row.
    pub earliest_s: Option<f64>,
    /// The place that becomes (0, 0), m; without one, coordinates beyond 100 km are moved.
    pub origin: Option<(f64, f64)>,
    /// Which scene of a file with several; the first one without.
    pub scene: Option<String>,
    /// How long an object is there without a row, s; without one, 2 s or three usual steps.
    pub max_gap_s: Option<f64>,
    /// Classes of names that are not known otherwise.
    pub classes: BTreeMap<String, Class>,
    /// Sizes and classes by SUMO's vehicle types.
    pub vehicle_types: BTreeMap<String, VehicleType>,
}

/// What SUMO's `vType` says of its vehicles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VehicleType {
    /// By its `vClass`.
    pub class: Option<Class>,
    /// m.
    pub width_m: Option<f64>,
    /// m.
    pub length_m: Option<f64>,
}
