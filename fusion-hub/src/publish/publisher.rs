//! Which tracks are published, predicted to the time of publishing.

use super::classes::PublishedClasses;
use super::list::ObjectList;
use super::mixture::{HypothesisMixtures, mixture_moments};
use super::object::{PublishedEstimate, fill, fill_contributors};
use super::readings::{Readings, lasting_variance};
use crate::filter::Filter;
use crate::filter::size_priors::{Contribution, SizePriors, TrackSizePriors};
use crate::track::Track;
use crate::values::{AgentNames, Coast};
use v2x_common::time::{Span, Timestamp};

/// Detections from which on a deleted track counts for the sizes of its class: the number separates it from clutter.
const MIN_DETECTIONS_OF_DELETED: u32 = 10;

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
pub(crate) struct Publisher {
    pub(super) config: PublishConfig,
    /// Sizes of deleted tracks.
    pub(super) past_sizes: SizePriors,
    /// What each track adds to the priors; the memory is used again.
    pub(super) contributions: Vec<Option<Contribution>>,
}

impl Publisher {
    pub(crate) fn new(config: PublishConfig) -> Self {
        let past_sizes = if config.class_size_priors { SizePriors::default() } else { SizePriors::FLAT };
        Self { config, past_sizes, contributions: Vec::new() }
    }

    /// Writes the objects as of `now`.
    pub(crate) fn write<F: Filter>(
        &mut self,
        objects: &mut ObjectList<'_>,
        list: &TrackList<'_, F>,
        now: Timestamp,
    ) {
        let leading = || list.tracks.iter().filter(|track| track.holders.leads());
        let mut contributions = std::mem::take(&mut self.contributions);
        let priors = self.size_priors(leading(), &mut contributions);
        let mixtures = HypothesisMixtures::of(list.tracks, list.n_hypotheses);
        let with_contributions = leading().zip(&contributions);
        for (track, own) in with_contributions.filter(|(track, _)| !(list.readings.hidden)(track.id)) {
            let priors = priors.of_track(*own);
            let Some(mut published) = self.published(track, &mixtures, (list, &priors), now) else {
                continue;
            };
            let shared = &track.latest().shared_error;
            let lasting = lasting_variance(track.contributors(), shared, list.readings, now);
            published.estimate.add_position_variance(lasting);
            objects.push_with(|object| {
                let is_filled = fill(object, track, &published);
                if is_filled {
                    fill_contributors(object, track.contributors(), list.agents);
                }
                is_filled
            });
        }
        self.contributions = contributions;
    }

    /// The estimate of a track as of `now`; `None` where the track is not published.
    fn published<F: Filter>(
        &self,
        track: &Track<F>,
        mixtures: &HypothesisMixtures<'_, F>,
        (list, priors): (&TrackList<'_, F>, &TrackSizePriors<'_>),
        now: Timestamp,
    ) -> Option<PublishedEstimate> {
        let last_measured_at = track.last_measured_at();
        let exists_by = |track: &Track<F>| track.latest().existence_at(now);
        let existence = mixtures.of_track(track).map(|(share, version)| share * exists_by(version)).sum();
        let is_supported = track.latest().support.is_for_a_real_object();
        if existence < self.config.existence
            || now - last_measured_at > self.config.coast.of(track.latest().interval_s)
            || !is_supported
        {
            return None;
        }
        let classes = PublishedClasses::of(track, list.agents, list.readings);
        let estimate = |track: &Track<F>| {
            classes.estimate(&track.latest().state_at(now, self.config.synchronous), priors)
        };
        let estimate = match track.holders.is_all() {
            true => estimate(track),
            false => {
                mixture_moments(mixtures.of_track(track).map(|(share, version)| (share, estimate(version))))
            }
        };
        Some(PublishedEstimate { estimate, existence, at: now, last_measured_at, classes })
    }

    /// The priors of sizes by class: of deleted tracks, and of these. What each of these adds is listed.
    pub(super) fn size_priors<'a, F: Filter + 'a>(
        &self,
        tracks: impl Iterator<Item = &'a Track<F>>,
        contributions: &mut Vec<Option<Contribution>>,
    ) -> SizePriors {
        let mut priors = self.past_sizes.clone();
        contributions.clear();
        contributions.extend(tracks.map(|track| {
            let latest = track.latest();
            // All that is published counts; clutter does not.
            let counts = latest.existence.probability() >= self.config.existence;
            let evidence = latest.state.size_evidence().filter(|_| counts)?;
            priors.note(latest.class(), evidence)
        }));
        priors
    }

    /// Keeps what a track that is being deleted has shown of the sizes of its class.
    pub(crate) fn note_deleted<F: Filter>(&mut self, track: &Track<F>) {
        let latest = track.latest();
        if track.holders.leads()
            && let Some(evidence) = latest.state.size_evidence()
            && latest.n_reports >= MIN_DETECTIONS_OF_DELETED
        {
            self.past_sizes.note(latest.class(), evidence);
            self.past_sizes.fade(latest.class());
        }
    }
}
