//! Small sequences for the tests of the metrics: cars on a line.

use crate::data::scene::TrueBox;
use crate::score::tracking::sequence::{Instant, ReportedBox, Sequence};
use v2x_agent::truth::ObjectId;
use v2x_common::class::Class;
use v2x_common::geometry::BevBox;

pub(crate) fn at(x: f64) -> BevBox {
    BevBox { x, y: 0.0, w: 2.0, d: 4.0, yaw: 0.0 }
}

pub(crate) fn truth(id: u32, x: f64) -> TrueBox {
    TrueBox { id: ObjectId(id), class: Class::Car, bev: at(x) }
}

pub(crate) fn reported(track: u64, x: f64) -> ReportedBox {
    ReportedBox { track, class: Class::Car, score: 1.0, bev: at(x) }
}

/// Objects and tracks, each with its x, m.
pub(crate) fn instant(objects: &[(u32, f64)], tracks: &[(u64, f64)]) -> Instant {
    Instant {
        truth: objects.iter().map(|&(id, x)| truth(id, x)).collect(),
        reported: tracks.iter().map(|&(track, x)| reported(track, x)).collect(),
    }
}

/// What [`instant`] takes.
pub(crate) type Xs<'a> = (&'a [(u32, f64)], &'a [(u64, f64)]);

/// A sequence of [`instant`]s.
pub(crate) fn sequence(instants: &[Xs]) -> Sequence {
    Sequence::new(instants.iter().map(|(objects, tracks)| instant(objects, tracks)).collect()).unwrap()
}
