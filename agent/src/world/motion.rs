//! How an object moves through the loop.

use std::sync::Arc;

use v2x_common::geometry::Pose;
use v2x_common::time::Span;

use super::path::Path;
use super::profile::Profile;
use crate::trajectories::{State, Trajectory};

/// How one object moves.
#[derive(Clone, Debug)]
pub(super) enum Motion {
    /// At rest.
    Standing(Pose),
    /// On a path.
    Riding(Ride),
    /// From one recorded place to the next.
    Recorded(Arc<Trajectory>),
}

/// A ride along a path, which repeats in every period and ends before the next one starts.
#[derive(Clone, Debug)]
pub(super) struct Ride {
    path: Arc<Path>,
    profile: Arc<Profile>,
    /// When the ride begins, in scenario time.
    start: Span,
    period: Span,
}

impl Motion {
    /// A ride that is absent between its end and the next period.
    pub(super) fn passing(path: &Arc<Path>, profile: Profile, start_s: f64, period: Span) -> Self {
        debug_assert!(profile.duration_s() < period.as_secs_f64(), "one ride of {} s", profile.duration_s());
        Self::riding(path, Arc::new(profile), start_s, period)
    }

    /// A ride that ends where it began and takes the whole period.
    pub(super) fn circling(path: &Arc<Path>, profile: &Arc<Profile>, start_s: f64, period: Span) -> Self {
        debug_assert!(
            (profile.duration_s() - period.as_secs_f64()).abs() < 1e-6,
            "{} s",
            profile.duration_s()
        );
        Self::riding(path, Arc::clone(profile), start_s, period)
    }

    fn riding(path: &Arc<Path>, profile: Arc<Profile>, start_s: f64, period: Span) -> Self {
        Self::Riding(Ride { path: Arc::clone(path), profile, start: Span::from_secs_f64(start_s), period })
    }

    /// Pose and velocity at a time within the loop; `None` while it is absent.
    pub(super) fn at(&self, t: Span) -> Option<State> {
        match self {
            Self::Standing(pose) => Some(State { pose: *pose, velocity: (0.0, 0.0) }),
            Self::Riding(ride) => ride.at(t),
            Self::Recorded(trajectory) => trajectory.at(t),
        }
    }
}

impl Ride {
    fn at(&self, t: Span) -> Option<State> {
        let since_start = (t - self.start).as_nanos().rem_euclid(self.period.as_nanos());
        let since_start_s = Span::from_nanos(since_start).as_secs_f64();
        // Closed rides last the whole period, up to rounding.
        if since_start_s > self.profile.duration_s() + 1e-6 {
            return None;
        }
        let (distance_m, speed_mps) = self.profile.at(since_start_s);
        let pose = self.path.at(distance_m);
        let (sin, cos) = libm::sincos(pose.yaw);
        Some(State { pose, velocity: (speed_mps * cos, speed_mps * sin) })
    }
}
