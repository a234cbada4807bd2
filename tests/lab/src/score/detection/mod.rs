//! Metrics of detection: average precision and errors, box by box, without identities.
//!
//! The data model is that of the tracking metrics ([`Sequence`](crate::score::tracking::Sequence)), and the velocities of
//! its boxes beside it. [`nuscenes`] has nuScenes' AP at centre distances, its true positive errors and NDS; [`overlap`] AP
//! at intersections over union. Each gives the figures of the field's reference implementation (`tests/it/oracles`).

mod classes;
mod figures;
mod interpolation;
pub mod nuscenes;
pub mod overlap;

pub use classes::DetectionClass;
pub(crate) use figures::DetectionScore;

use crate::score::tracking::Sequence;

/// The velocities of the boxes of one instant, east and north, m/s; `None` where one is not known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Velocities {
    /// Of the true boxes, by place.
    pub truth: Vec<Option<[f64; 2]>>,
    /// Of the reported boxes, by place.
    pub reported: Vec<Option<[f64; 2]>>,
}

/// One scene.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The boxes. The score of a reported box is its confidence.
    pub sequence: &'a Sequence,
    /// Their velocities, by instant; where this is too short they are not known.
    pub velocities: &'a [Velocities],
}
