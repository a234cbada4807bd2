//! UniKF's filters: one object's state and its two steps, predict and update.
//!
//! [`Filter`] is what a track needs of a filter. [`State`] is the paper's: [x y vx vy w d θ] (eq. 7) with a
//! constant-velocity transition (eq. 8) and a measurement [x y w d θ] (eq. 9). Reports carry no cross terms
//! between position, width, depth and heading, so the 7-state filter falls apart, exactly, into a 4-state one
//! for position and velocity and three scalar ones.

pub mod imm;
mod intersection;
mod kinematic;
mod log_normal;
mod manoeuvring;
mod params;
mod retrodiction;
mod scalar;
pub mod size_evidence;
mod size_posterior;
pub mod size_priors;
mod smoothing;
mod state;
#[cfg(test)]
mod together;

pub use intersection::intersection_weight;
use intersection::weight_against_track;
pub use kinematic::{Cross, Kinematic};
pub use manoeuvring::ImmState;
pub use params::MotionParams;
pub use scalar::{Heading, Size};
pub use state::State;

use crate::values::{Measurement, PositionInnovation, PredictedMeasurement};
use serde::Serialize;
use serde::de::DeserializeOwned;
use size_evidence::SizeEvidence;
use size_priors::TrackSizePriors;
use std::fmt::Debug;
use v2x_common::class::Class;
use v2x_common::covariance::Covariance2;
use v2x_common::fused::KinematicCovariance;
use v2x_common::time::Timestamp;

/// One object's state under one model of motion, at one time.
pub trait Filter: Copy + Debug + PartialEq + Serialize + DeserializeOwned {
    /// Whether several states are updated faster together ([`Self::update_some`]) than one by one.
    const TOGETHER: bool = false;

    /// The state after a first measurement.
    fn initial(at: Timestamp, z: &Measurement) -> Self;

    /// Time of the state.
    fn at(&self) -> Timestamp;

    /// Moves the state of an object of this class to another time, later or earlier.
    fn predict(&mut self, to: Timestamp, class: Class);

    /// The state of an object of this class at another time, later or earlier.
    #[must_use]
    #[inline]
    fn predicted(&self, to: Timestamp, class: Class) -> Self {
        let mut state = *self;
        state.predict(to, class);
        state
    }

    /// Moves the states of some objects. The bits are those of [`Self::predict`], one state after the other.
    #[inline]
    fn predict_some<T: Holds<Self>>(objects: &mut [T], due: &[Due]) {
        for Due { place, class, to } in due {
            objects[*place].state_mut().predict(*to, *class);
        }
    }

    /// The smoothed state, given the `later` one, where nothing was reported after this state and
    /// before that time. Where both are of one time, it is the later one.
    #[must_use]
    fn smoothed(&self, class: Class, later: &Self) -> Self;

    /// Updates by a measurement made at the state's time; returns the innovation.
    fn update(&mut self, z: &Measurement) -> PositionInnovation;

    /// Updates the states of some objects, those at these places, by measurements made at their times; calls `take` with the
    /// number of each in the list and its innovation, in any order. The bits are those of [`Self::update`], one state after the other.
    #[inline]
    fn update_some<T: Holds<Self>>(
        objects: &mut [T],
        some: &[(usize, Measurement)],
        mut take: impl FnMut(usize, PositionInnovation),
    ) {
        for (number, (place, z)) in some.iter().enumerate() {
            take(number, objects[*place].state_mut().update(z));
        }
    }

    /// Position (m) and its larger standard deviation along an axis (m), at another time.
    fn place_at(&self, to: Timestamp, class: Class) -> ([f64; 2], f64);

    /// The same at the state's own time, approximately and cheaply: a prefilter for distant objects.
    fn rough_position(&self) -> ([f64; 2], f64);

    /// The variances of the position along both axes together, m²; without what the means of several models differ by.
    fn position_variance(&self) -> f64;

    /// What association needs.
    fn predicted_measurement(&self, class: Class) -> PredictedMeasurement;

    /// Calls `take` with what association needs of each of these states, in order; `class` gives the class of the one at a
    /// place. The bits are those of [`Self::predicted_measurement`].
    #[inline]
    fn predicted_measurements(
        states: &[Self],
        class: impl Fn(usize) -> Class,
        mut take: impl FnMut(PredictedMeasurement),
    ) {
        for (place, state) in states.iter().enumerate() {
            take(state.predicted_measurement(class(place)));
        }
    }

    /// Heading (rad) and its variance (rad²), approximately and cheaply.
    fn heading(&self) -> (f64, f64);

    /// Width and depth (m) and their variances (m²), approximately.
    fn rough_size(&self) -> ([f64; 2], [f64; 2]);

    /// Turns the object round: the front is at the other end. Position and velocity stay.
    fn turn_round(&mut self);

    /// Sets heading and speed to a course; what is correlated with them is not any more.
    fn redirect(&mut self, course: &Course);

    /// Sets the heading (rad) with its variance (rad²); what is correlated with it is not any more.
    fn turn_to(&mut self, yaw: f64, variance: f64);

    /// Sets the position with its covariance (m, m²); what is correlated with it is not any more.
    fn move_to(&mut self, position: [f64; 2], covariance: &Covariance2);

    /// Adds a variance (m²) to the position along each axis.
    fn widen_position(&mut self, variance: f64);

    /// Velocity and turn rate at the state's own time.
    fn motion(&self) -> Motion;

    /// That turn rate alone, rad/s: 0 of a filter that has none.
    fn turn_rate(&self) -> f64;

    /// Evidence of width and depth, where the filter keeps it; class priors are then learnt from it.
    fn size_evidence(&self) -> Option<&[SizeEvidence; 2]>;

    /// Position, velocity and heading as they are published.
    fn pose(&self) -> PoseEstimate;

    /// Calls `take` with the poses of these states, in order. The bits are those of [`Self::pose`].
    #[inline]
    fn poses(states: &[Self], take: impl FnMut(PoseEstimate)) {
        states.iter().map(Self::pose).for_each(take);
    }

    /// Width and depth of an object of this class as they are published.
    fn sizes(&self, class: Class, priors: &TrackSizePriors<'_>) -> [Size; 2];

    /// The published estimate of an object of this class.
    fn estimate(&self, class: Class, priors: &TrackSizePriors<'_>) -> Estimate {
        self.pose().with_sizes(self.sizes(class, priors))
    }
}

/// A prediction that is due.
#[derive(Clone, Copy, Debug)]
pub struct Due {
    /// The place of the object.
    pub place: usize,
    /// Its class.
    pub class: Class,
    /// The time that it is predicted to.
    pub to: Timestamp,
}

/// Something with a state.
pub trait Holds<F> {
    /// The state.
    fn state(&self) -> &F;
    /// The state, to be changed.
    fn state_mut(&mut self) -> &mut F;
}

/// A state holds itself.
impl<F: Filter> Holds<F> for F {
    #[inline(always)]
    fn state(&self) -> &F {
        self
    }

    #[inline(always)]
    fn state_mut(&mut self) -> &mut F {
        self
    }
}

/// The direction of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Direction, rad.
    pub yaw: f64,
    /// Its variance, rad².
    pub yaw_variance: f64,
    /// m/s.
    pub speed: f64,
    /// m²/s².
    pub speed_variance: f64,
}

/// How an object moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// m/s.
    pub velocity: [f64; 2],
    /// Its covariance, m²/s².
    pub covariance: Covariance2,
    /// Covariance of position and velocity, its symmetric part, m²/s.
    pub with_position: Covariance2,
    /// rad/s.
    pub turn_rate: f64,
    /// rad²/s².
    pub turn_rate_variance: f64,
}

/// A filter's estimate of an object: means and variances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Position, m.
    pub position: [f64; 2],
    /// Velocity, m/s.
    pub velocity: [f64; 2],
    /// Covariance of both.
    pub covariance: KinematicCovariance,
    /// Width, m and m².
    pub width: Size,
    /// Depth, m and m².
    pub depth: Size,
    /// Heading, rad and rad².
    pub heading: Heading,
}

/// A filter's estimate of an object but for its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseEstimate {
    /// Position, m.
    pub position: [f64; 2],
    /// Velocity, m/s.
    pub velocity: [f64; 2],
    /// Covariance of both.
    pub covariance: KinematicCovariance,
    /// Heading, rad and rad².
    pub heading: Heading,
}

impl PoseEstimate {
    /// With width and depth.
    pub const fn with_sizes(self, [width, depth]: [Size; 2]) -> Estimate {
        let Self { position, velocity, covariance, heading } = self;
        Estimate { position, velocity, covariance, width, depth, heading }
    }
}

impl Estimate {
    /// Adds a variance (m²) to the position along each axis.
    pub(crate) fn add_position_variance(&mut self, variance: f64) {
        for place in [0, 4] {
            self.covariance[place] += variance;
        }
    }
}

/// Every number of the filters, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    [params::listed(), imm::listed(), size_priors::listed()].concat()
}
