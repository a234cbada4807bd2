//! Which tracks are told of, and what.

use crate::config::EngineConfig;
use crate::filter::State;
use crate::track::Track;
use v2x_common::class::Class;
use v2x_common::detection::{MAX_SIGMA_M, MAX_SIGMA_YAW_RAD, MAX_SIZE_M};
use v2x_common::fused::FusedObject;
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Fills the list with the objects as of `now`; what the list held is overwritten, its memory used again.
pub(crate) fn fill(
    objects: &mut Vec<FusedObject>,
    tracks: &mut [Track],
    now: Timestamp,
    config: &EngineConfig,
) {
    let mut count = 0;
    for track in tracks {
        if objects.len() == count {
            objects.push(blank());
        }
        count += usize::from(tell(&mut objects[count], track, now, config));
    }
    objects.truncate(count);
}

/// Writes down the object of a track; `false` where it is not told of.
fn tell(object: &mut FusedObject, track: &mut Track, now: Timestamp, config: &EngineConfig) -> bool {
    let last_measured_at = track.last_measured_at();
    let latest = track.latest();
    let existence = latest.existence.survived(now - latest.at).probability();
    let exists = existence >= config.publish_existence;
    if !exists || now - last_measured_at > config.coast {
        return false;
    }
    let state = latest.state_at(now);
    if !is_tellable(&state) {
        return false;
    }
    let [vx, vy] = state.kinematic.velocity;
    object.class = latest.class();
    object.class_probabilities.clear();
    object.class_probabilities.extend(latest.class_shares());
    object.bev = state.bev();
    object.velocity = (vx, vy);
    object.kinematic_covariance = state.kinematic.covariance();
    object.ww = state.width.variance;
    object.dd = state.depth.variance;
    object.yaw_variance = state.heading.variance;
    object.existence = existence;
    object.age = now - latest.born_at;
    object.last_measured_at = last_measured_at;
    object.track = track.id;
    object.contributors.clear();
    object.contributors.extend(track.contributors());
    true
}

fn blank() -> FusedObject {
    FusedObject {
        track: TrackId::default(),
        class: Class::Unknown,
        class_probabilities: Vec::new(),
        bev: BevBox::default(),
        velocity: (0.0, 0.0),
        kinematic_covariance: [0.0; 10],
        ww: 0.0,
        dd: 0.0,
        yaw_variance: 0.0,
        existence: 0.0,
        age: Span::ZERO,
        last_measured_at: Timestamp::EPOCH,
        contributors: Vec::new(),
    }
}

/// Whether a state says anything, and fits on the wire: a position known to no better than 70 m does not.
fn is_tellable(state: &State) -> bool {
    let kinematic = &state.kinematic;
    let size = 0.0..=MAX_SIZE_M;
    kinematic.pp.max_sigma() <= MAX_SIGMA_M
        && kinematic.vv.max_sigma() <= MAX_SIGMA_M
        && state.heading.variance <= MAX_SIGMA_YAW_RAD * MAX_SIGMA_YAW_RAD
        && size.contains(&state.width.mean)
        && size.contains(&state.depth.mean)
        && state.width.variance.max(state.depth.variance) <= MAX_SIGMA_M * MAX_SIGMA_M
}
