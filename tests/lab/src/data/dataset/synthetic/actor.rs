//! One object of a scene, and its motion.

use crate::data::dataset::synthetic::body::Body;
use std::sync::Arc;
use v2x_agent::world::path::Path;
use v2x_agent::world::profile::Profile;
use v2x_common::geometry::Pose;
use v2x_common::time::Span;

/// The motion of an object.
#[derive(Clone, Debug)]
pub(super) enum Motion {
    /// It is parked or stands.
    Standing(Pose),
    /// It follows a path: its distance along the path at time 0, m, and its profile of distance over time.
    Following(Arc<Path>, f64, Arc<Profile>),
}

/// One object.
#[derive(Clone, Debug)]
pub(super) struct Actor {
    pub(super) body: Body,
    pub(super) motion: Motion,
    /// Offset to the left of its path, m.
    pub(super) aside_m: f64,
}

impl Actor {
    pub(super) fn standing(body: Body, pose: Pose) -> Self {
        Self { body, motion: Motion::Standing(pose), aside_m: 0.0 }
    }

    /// The pose of its centre. Vehicles follow their path with the rear axle.
    pub(super) fn pose(&self, at: Span) -> Pose {
        match &self.motion {
            Motion::Standing(pose) => *pose,
            Motion::Following(path, from_m, profile) => {
                let lead_m = self.body.axle_to_centre_m();
                let pose = path.at(from_m + profile.at(at.as_secs_f64()).0 - lead_m);
                let (x, y) = pose.offset(lead_m, self.aside_m);
                Pose { x, y, yaw: pose.yaw }
            }
        }
    }
}
