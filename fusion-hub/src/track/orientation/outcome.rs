//! What a report does to a track's filter.

use crate::filter::Course;
use crate::values::{Measurement, PositionInnovation};
use v2x_common::covariance::Covariance2;

/// What a report does to the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Read {
    /// The measurement as it is taken.
    pub(crate) z: Measurement,
    /// What is done to the state first.
    pub(in crate::track) first: Action,
    /// What positions alone made of the report.
    pub(in crate::track) by_positions: PositionInnovation,
    /// Of the variance of its position, what says that it counts for less, and not how far off it may be, m².
    pub(in crate::track) discount: f64,
}

impl Read {
    /// As it was reported, with nothing else known of it.
    pub(in crate::track) const fn as_reported(z: &Measurement) -> Self {
        let by_positions = PositionInnovation { mahalanobis2: 0.0, determinant: 1.0 };
        Self { z: *z, first: Action::Nothing, by_positions, discount: 0.0 }
    }
}

/// What is done to the state before it is updated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::track) enum Action {
    /// Nothing.
    Nothing,
    /// It is turned round: the front is at the other end.
    TurnRound,
    /// It is set to its course.
    Redirect(Course),
    /// It stands and has this heading, with this variance, rad and rad².
    TurnTo(f64, f64),
}

/// Where an object is and moves by positions alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::track) struct Path {
    pub(in crate::track) position: [f64; 2],
    pub(in crate::track) covariance: Covariance2,
    pub(in crate::track) course: Course,
}
