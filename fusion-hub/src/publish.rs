//! Which tracks are told of, and what.

use crate::agents::Agents;
use crate::config::EngineConfig;
use crate::filter::size_priors::SizePriors;
use crate::filter::{Estimate, Filter};
use crate::particles::{Doubts, blended};
use crate::track::{Contributors, Track};
use v2x_common::class::Class;
use v2x_common::detection::{MAX_SIGMA_M, MAX_SIGMA_YAW_RAD, MAX_SIZE_M};
use v2x_common::fused::{FusedObject, KINEMATIC_DIAGONAL};
use v2x_common::geometry::BevBox;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Reports from which on an object that is gone has taught something of its class.
const REMEMBERED_REPORTS: u32 = 10;

/// Writes down objects; holds the memory of those that a shorter list has no use for.
#[derive(Debug)]
pub(crate) struct Publisher {
    pub(crate) spare: Vec<FusedObject>,
    /// Sizes of objects that are gone.
    pub(crate) past_sizes: SizePriors,
}

impl Publisher {
    pub(crate) fn new(config: &EngineConfig) -> Self {
        let has_priors = config.class_priors && config.class_size_priors;
        Self {
            spare: Vec::new(),
            past_sizes: if has_priors { SizePriors::default() } else { SizePriors::FLAT },
        }
    }

    /// Fills the list with the objects as of `now`; what the list held is overwritten, its memory used again.
    pub(crate) fn fill<F: Filter>(
        &mut self,
        objects: &mut Vec<FusedObject>,
        (tracks, n_particles): (&[Track<F>], u32),
        (now, agents): (Timestamp, &Agents),
        config: &EngineConfig,
    ) {
        let mut priors = self.past_sizes.clone();
        let leading = || tracks.iter().filter(|track| track.holders.leads());
        for track in leading() {
            note_sizes(&mut priors, track, config);
        }
        let doubts = Doubts::of(tracks, n_particles);
        let mut count = 0;
        for track in leading() {
            if objects.len() == count {
                objects.push(self.spare.pop().unwrap_or_else(blank));
            }
            count +=
                usize::from(tell(&mut objects[count], (track, &doubts), (now, agents), (config, &priors)));
        }
        self.spare.extend(objects.drain(count..));
    }

    /// Remembers what a track that is gone has shown of the sizes of its class.
    pub(crate) fn note_gone<F: Filter>(&mut self, track: &Track<F>) {
        // What is gone is hardly believed in any more; how often it was reported tells it from clutter.
        let latest = track.latest();
        if let Some(evidence) = latest.state.size_evidence()
            && latest.n_reports >= REMEMBERED_REPORTS
        {
            self.past_sizes.note(latest.class(), evidence);
            self.past_sizes.fade(latest.class());
        }
    }
}

/// Adds what a track shows of the sizes of its class, where its filter keeps that.
pub(crate) fn note_sizes<F: Filter>(priors: &mut SizePriors, track: &Track<F>, config: &EngineConfig) {
    let latest = track.latest();
    // All that is told of is noted, and clutter teaches nothing.
    if let Some(evidence) = latest.state.size_evidence()
        && latest.existence.probability() >= config.publish_existence
    {
        priors.note(latest.class(), evidence);
    }
}

/// Writes down the object of a track; `false` where it is not told of.
fn tell<F: Filter>(
    object: &mut FusedObject,
    (track, doubts): (&Track<F>, &Doubts<'_, F>),
    (now, agents): (Timestamp, &Agents),
    (config, priors): (&EngineConfig, &SizePriors),
) -> bool {
    let last_measured_at = track.last_measured_at();
    let exists_by = |track: &Track<F>| track.latest().existence_at(now);
    let existence = doubts.of_same(track).map(|(share, version)| share * exists_by(version)).sum();
    let exists = existence >= config.publish_existence;
    if !exists || now - last_measured_at > config.coast {
        return false;
    }
    let estimate = |track: &Track<F>| {
        let latest = track.latest();
        latest.state_at(now, config.filter_synchronous).estimate(latest.class(), priors)
    };
    let told = match track.holders.is_all() {
        true => estimate(track),
        false => blended(doubts.of_same(track).map(|(share, version)| (share, estimate(version)))),
    };
    write_down(object, track, &Told { estimate: told, existence, at: now, last_measured_at }) && {
        name_contributors(object, track.contributors(), agents);
        true
    }
}

/// What is told of a track, and the time that it holds for.
pub(crate) struct Told {
    pub(crate) estimate: Estimate,
    pub(crate) existence: f64,
    pub(crate) at: Timestamp,
    pub(crate) last_measured_at: Timestamp,
}

/// Writes down an object but for its contributors; `false` where it cannot be told.
pub(crate) fn write_down<F: Filter>(object: &mut FusedObject, track: &Track<F>, told: &Told) -> bool {
    let Told { estimate: told, existence, at, last_measured_at } = told;
    if !is_tellable(told) {
        return false;
    }
    let latest = track.latest();
    let [x, y] = told.position;
    object.class = latest.class();
    object.class_probabilities.clear();
    object.class_probabilities.extend(latest.class_shares());
    object.bev = BevBox { x, y, w: told.width.mean, d: told.depth.mean, yaw: told.heading.mean };
    object.velocity = (told.velocity[0], told.velocity[1]);
    object.kinematic_covariance = told.covariance;
    object.ww = told.width.variance;
    object.dd = told.depth.variance;
    object.yaw_variance = told.heading.variance;
    object.existence = *existence;
    object.age = *at - latest.born_at;
    object.last_measured_at = *last_measured_at;
    object.track = track.id;
    true
}

pub(crate) fn name_contributors(object: &mut FusedObject, contributors: &Contributors, agents: &Agents) {
    object.contributors.clear();
    object.contributors.extend(contributors.iter().map(|newest| newest.measurement(agents)));
}

pub(crate) fn blank() -> FusedObject {
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

/// Whether an estimate says anything, and fits on the wire: a position known to no better than 70 m does not.
fn is_tellable(told: &Estimate) -> bool {
    let size = 0.0..=MAX_SIZE_M;
    KINEMATIC_DIAGONAL.iter().all(|place| told.covariance[*place] <= MAX_SIGMA_M * MAX_SIGMA_M)
        && told.heading.variance <= MAX_SIGMA_YAW_RAD * MAX_SIGMA_YAW_RAD
        && size.contains(&told.width.mean)
        && size.contains(&told.depth.mean)
        && told.width.variance.max(told.depth.variance) <= MAX_SIGMA_M * MAX_SIGMA_M
}
