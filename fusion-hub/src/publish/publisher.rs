//! Which tracks are published, predicted to the time of publishing.

use super::classes::PublishedClasses;
use super::list::ObjectList;
use super::mixture::{HypothesisMixtures, mixture_moments};
use super::object::{PublishedEstimate, fill, fill_contributors};
use super::readings::{Readings, lasting_variance};
use crate::filter::size_priors::{Contribution, SizePriors};
use crate::filter::{Due, Filter, PoseEstimate};
use crate::track::Track;
use crate::values::{AgentNames, Coast, saved};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Detections from which on a deleted track counts for the sizes of its class: the number separates it from clutter.
const MIN_DETECTIONS_OF_DELETED: u32 = 10;

/// Tracks whose objects are written together: the states of so many stay in the nearest memory.
const TOGETHER: usize = 32;

/// Which tracks are published.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PublishConfig {
    /// Least probability of existence.
    pub(crate) existence: f64,
    /// Longest time since the last detection.
    pub(crate) coast: Coast,
    /// Whether the sizes of all objects of a class are a prior of each.
    pub(crate) class_size_priors: bool,
    /// Within this of a track's own time it is not predicted.
    pub(crate) synchronous: Span,
}

/// The tracks to be published.
#[derive(Clone, Copy)]
pub(crate) struct TrackList<'a, F> {
    /// Every track, all versions of it, by id.
    pub(crate) tracks: &'a [Track<F>],
    /// How many hypotheses of association there are.
    pub(crate) n_hypotheses: u32,
    /// Names of the agents.
    pub(crate) agents: &'a AgentNames,
    /// Tracks that are not published, errors that last, and how classes err.
    pub(crate) readings: &'a Readings<'a>,
}

/// Makes lists of objects.
#[derive(Debug)]
pub(crate) struct Publisher<F> {
    pub(super) config: PublishConfig,
    /// Sizes of deleted tracks.
    pub(super) past_sizes: SizePriors,
    /// What each track has added to the priors, by id, and what it had added to the list before.
    pub(super) contributions: Vec<Added>,
    before: Vec<Added>,
    /// The tracks that are being written, their states, and the poses of these.
    listed: Vec<Listed>,
    states: Vec<F>,
    due: Vec<Due>,
    poses: Vec<PoseEstimate>,
}

/// A track, and what it adds to the priors of sizes.
pub(super) type Added = (TrackId, Option<Contribution>);

/// What is known of all tracks.
struct Known<'a, F> {
    list: &'a TrackList<'a, F>,
    priors: &'a SizePriors,
    contributions: &'a [Added],
    mixtures: &'a HypothesisMixtures<'a, F>,
    now: Timestamp,
}

/// A track that is published.
#[derive(Clone, Copy, Debug)]
struct Listed {
    /// Its place among all tracks.
    track: usize,
    /// And among what tracks add to the priors of sizes.
    contribution: usize,
    existence: f64,
}

saved!([F: Filter] Publisher<F>, saved { past_sizes }, made_anew {
    config, contributions, before, listed, states, due, poses
});

impl<F: Filter> Publisher<F> {
    pub(crate) fn new(config: PublishConfig) -> Self {
        let past_sizes = if config.class_size_priors { SizePriors::default() } else { SizePriors::FLAT };
        Self {
            config,
            past_sizes,
            contributions: Vec::new(),
            before: Vec::new(),
            listed: Vec::new(),
            states: Vec::new(),
            due: Vec::new(),
            poses: Vec::new(),
        }
    }

    /// Writes the objects as of `now`.
    pub(crate) fn write(&mut self, objects: &mut ObjectList<'_>, list: &TrackList<'_, F>, now: Timestamp) {
        let leading = || list.tracks.iter().enumerate().filter(|(_, track)| track.holders.leads());
        let priors = self.size_priors(leading().map(|(_, track)| track));
        let contributions = std::mem::take(&mut self.contributions);
        let mixtures = HypothesisMixtures::of(list.tracks, list.n_hypotheses);
        let known = Known { list, priors: &priors, contributions: &contributions, mixtures: &mixtures, now };
        for (contribution, (place, track)) in leading().enumerate() {
            self.list(&known, (place, track), contribution);
            if self.listed.len() == TOGETHER {
                self.write_listed(objects, &known);
            }
        }
        self.write_listed(objects, &known);
        self.contributions = contributions;
    }

    /// Lists a track if it is published, with its state, which is still to be predicted.
    fn list(&mut self, known: &Known<'_, F>, (place, track): (usize, &Track<F>), contribution: usize) {
        let Known { list, mixtures, now, .. } = *known;
        if (list.readings.hidden)(track.id) {
            return;
        }
        let Some(existence) = self.published_existence(track, mixtures, now) else { return };
        let latest = track.latest();
        if (now - latest.state.at()).abs() > self.config.synchronous {
            self.due.push(Due { place: self.states.len(), class: latest.motion_class(), to: now });
        }
        self.states.push(latest.state);
        self.listed.push(Listed { track: place, contribution, existence });
    }

    /// Writes the objects of the tracks that are listed, all at once: several of them fit into one instruction.
    fn write_listed(&mut self, objects: &mut ObjectList<'_>, known: &Known<'_, F>) {
        let Known { list, now, .. } = *known;
        let Self { config, listed, states, due, poses, .. } = self;
        F::predict_some(states, due);
        F::poses(states, |pose| poses.push(pose));
        for ((listed, state), pose) in listed.iter().zip(states.iter()).zip(poses.iter()) {
            let track = &list.tracks[listed.track];
            let classes = PublishedClasses::of(track, list.agents, list.readings);
            let priors = known.priors.of_track(known.contributions[listed.contribution].1.as_ref());
            let mut estimate = match track.holders.is_all() {
                true => pose.with_sizes(classes.sizes(state, &priors)),
                false => mixture_moments(known.mixtures.of_track(track).map(|(share, version)| {
                    let state = version.latest().state_at(now, config.synchronous);
                    (share, classes.estimate(&state, &priors))
                })),
            };
            let shared = &track.latest().shared_error;
            estimate.add_position_variance(lasting_variance(
                track.contributors(),
                shared,
                list.readings,
                now,
            ));
            let (existence, last_measured_at) = (listed.existence, track.last_measured_at());
            let published = PublishedEstimate { estimate, existence, at: now, last_measured_at, classes };
            let limit = objects.contributor_limit();
            objects.push_with(|object| {
                let is_filled = fill(object, track, &published);
                if is_filled {
                    fill_contributors(object, track.contributors(), limit, list.agents);
                }
                is_filled
            });
        }
        listed.clear();
        states.clear();
        due.clear();
        poses.clear();
    }

    /// The existence of a track as of `now`; `None` where it is not published.
    fn published_existence(
        &self,
        track: &Track<F>,
        mixtures: &HypothesisMixtures<'_, F>,
        now: Timestamp,
    ) -> Option<f64> {
        let exists_by = |track: &Track<F>| track.latest().existence_at(now);
        let existence = mixtures.of_track(track).map(|(share, version)| share * exists_by(version)).sum();
        let is_supported = track.latest().support.is_for_a_real_object();
        let has_gone = now - track.last_measured_at() > self.config.coast.of(track.latest().interval_s);
        (existence >= self.config.existence && !has_gone && is_supported).then_some(existence)
    }

    /// The priors of sizes by class: of deleted tracks, and of these, which are in the order of their ids. What each of these adds
    /// is kept.
    pub(super) fn size_priors<'a>(&mut self, tracks: impl Iterator<Item = &'a Track<F>>) -> SizePriors
    where
        F: 'a,
    {
        let Self { config, past_sizes, contributions, before, .. } = self;
        std::mem::swap(contributions, before);
        contributions.clear();
        let mut priors = past_sizes.clone();
        let mut before = before.iter().peekable();
        contributions.extend(tracks.map(|track| {
            while before.next_if(|(id, _)| *id < track.id).is_some() {}
            let known = before.next_if(|(id, _)| *id == track.id).and_then(|(_, known)| known.as_ref());
            let latest = track.latest();
            // All that is published counts; clutter does not.
            let counts = latest.existence.probability() >= config.existence;
            let evidence = latest.state.size_evidence().filter(|_| counts);
            (track.id, evidence.and_then(|evidence| priors.note(latest.class(), evidence, known)))
        }));
        priors
    }

    /// Keeps what a track that is being deleted has shown of the sizes of its class.
    pub(crate) fn note_deleted(&mut self, track: &Track<F>) {
        let latest = track.latest();
        if track.holders.leads()
            && let Some(evidence) = latest.state.size_evidence()
            && latest.n_reports >= MIN_DETECTIONS_OF_DELETED
        {
            self.past_sizes.note(latest.class(), evidence, None);
            self.past_sizes.fade(latest.class());
        }
    }
}
