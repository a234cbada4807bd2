//! A fused object from the estimate of a track.

use super::classes::PublishedClasses;
use crate::filter::{Estimate, Filter};
use crate::track::{Contributors, Track};
use crate::values::{AgentNames, ContributorLimit};
use v2x_common::detection::{HeadingKind, MAX_SIGMA_M, MAX_SIGMA_YAW_RAD, MAX_SIZE_M};
use v2x_common::fused::{FusedObject, KINEMATIC_DIAGONAL};
use v2x_common::geometry::BevBox;
use v2x_common::time::Timestamp;

/// A heading with a larger variance is not known, rad².
const UNKNOWN_BEYOND: f64 = 1.0;

/// The estimate of a track at the time for which it is published.
pub(super) struct PublishedEstimate {
    pub(super) estimate: Estimate,
    pub(super) existence: f64,
    pub(super) at: Timestamp,
    pub(super) last_measured_at: Timestamp,
    pub(super) classes: PublishedClasses,
}

/// Fills in an object, except its contributors; `false` where the wire has no room for its values.
pub(super) fn fill<F: Filter>(
    object: &mut FusedObject,
    track: &Track<F>,
    published: &PublishedEstimate,
) -> bool {
    let PublishedEstimate { estimate, existence, at, last_measured_at, classes } = published;
    if !is_representable(estimate) {
        return false;
    }
    let latest = track.latest();
    let [x, y] = estimate.position;
    object.class = classes.shares.leading();
    object.class_probabilities.clear();
    object.class_probabilities.extend_from_slice(classes.shares.listed());
    object.class_conflict = classes.conflict;
    object.bev = BevBox { x, y, w: estimate.width.mean, d: estimate.depth.mean, yaw: estimate.heading.mean };
    object.velocity = (estimate.velocity[0], estimate.velocity[1]);
    object.kinematic_covariance = estimate.covariance;
    object.ww = estimate.width.variance;
    object.dd = estimate.depth.variance;
    let (heading, more) = latest.orientation.heading(latest.motion_class());
    object.heading = if estimate.heading.variance > UNKNOWN_BEYOND { HeadingKind::Unknown } else { heading };
    object.yaw_variance = estimate.heading.variance + more;
    object.existence = *existence;
    object.age = *at - latest.initiated_at;
    object.last_measured_at = *last_measured_at;
    object.track = track.id;
    true
}

/// Fills in the contributors of an object, as many as it may name.
pub(super) fn fill_contributors(
    object: &mut FusedObject,
    contributors: &Contributors,
    limit: ContributorLimit,
    agents: &AgentNames,
) {
    object.contributors.clear();
    if limit == ContributorLimit::All {
        object.contributors.extend(contributors.iter().map(|newest| newest.measurement(agents)));
        return;
    }
    let mut named: Vec<_> = contributors.iter().collect();
    limit.apply(&mut named, |newest| newest.captured_at());
    object.contributors.extend(named.into_iter().map(|newest| newest.measurement(agents)));
}

/// Whether the wire has room for an estimate. It has none for a position with a standard deviation beyond 70 m, which
/// says nothing.
fn is_representable(estimate: &Estimate) -> bool {
    let size = 0.0..=MAX_SIZE_M;
    KINEMATIC_DIAGONAL.iter().all(|entry| estimate.covariance[*entry] <= MAX_SIGMA_M * MAX_SIGMA_M)
        && estimate.heading.variance <= MAX_SIGMA_YAW_RAD * MAX_SIGMA_YAW_RAD
        && size.contains(&estimate.width.mean)
        && size.contains(&estimate.depth.mean)
        && estimate.width.variance.max(estimate.depth.variance) <= MAX_SIGMA_M * MAX_SIGMA_M
}
