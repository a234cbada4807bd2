//! Objects as of an earlier time, by everything that is known by now.

use super::classes::PublishedClasses;
use super::list::ObjectList;
use super::object::{PublishedEstimate, fill, fill_contributors};
use super::publisher::Publisher;
use super::readings::{Readings, lasting_variance};
use crate::filter::Filter;
use crate::track::{FixedLagSmoother, SmoothedTrack, Track, TrackContext};
use v2x_common::time::Timestamp;

/// Tracks at an earlier time, and what their evidence refers to.
#[derive(Clone, Copy)]
pub(crate) struct PastTracks<'a, F> {
    /// All tracks of that time, by id.
    pub(crate) tracks: &'a [&'a Track<F>],
    /// The time.
    pub(crate) at: Timestamp,
    /// What their evidence refers to.
    pub(crate) context: &'a TrackContext<'a>,
    /// Tracks that are not published, and errors that last.
    pub(crate) readings: &'a Readings<'a>,
}

impl<F: Filter> Publisher<F> {
    /// Writes the objects as of an earlier time.
    ///
    /// An object is published if it had been detected by then and, by all that is known by now, existed then.
    pub(crate) fn write_as_of(
        &mut self,
        objects: &mut ObjectList<'_>,
        past: &PastTracks<'_, F>,
        smoother: &mut FixedLagSmoother<F>,
    ) {
        let PastTracks { tracks, at, context, readings } = *past;
        let leading = || tracks.iter().copied().filter(|track| track.holders.leads());
        let priors = self.size_priors(leading());
        for track in leading().filter(|track| !(readings.hidden)(track.id)) {
            let Some(smoothed) = smoother.smooth(track, at, context) else { continue };
            let SmoothedTrack { state, existence, is_supported, interval_s, last_measured_at } = smoothed;
            let coasts_for = self.config.coast.of(interval_s);
            if existence < self.config.existence || at - last_measured_at > coasts_for || !is_supported {
                continue;
            }
            let classes = PublishedClasses::of(track, context.agents, readings);
            let mut estimate = classes.estimate(&state, &priors.of_track(None));
            let shared = &track.latest().shared_error;
            let lasting = lasting_variance(smoother.contributors(), shared, readings, at);
            estimate.add_position_variance(lasting);
            let published = PublishedEstimate { estimate, existence, at, last_measured_at, classes };
            let limit = objects.contributor_limit();
            objects.push_with(|object| {
                let is_filled = fill(object, track, &published);
                if is_filled {
                    fill_contributors(object, smoother.contributors(), limit, context.agents);
                }
                is_filled
            });
        }
    }
}
