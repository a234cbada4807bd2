//! Tracks as they were before they were merged.
//!
//! With a lag, objects are published as of a time before a merge. Where a sensor had resolved the two tracks, the merge
//! means that one object is gone, and both tracks hold for the time before.

use super::context::{Horizon, TrackContext};
use super::track::Track;
use crate::filter::Filter;
use serde::{Deserialize, Serialize};
use v2x_common::time::{Span, Timestamp};

/// Two tracks before they were merged.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Pair<F> {
    /// The older one first.
    tracks: [Track<F>; 2],
    /// Until this time they were two: just before the frame that decided the merge was captured, or when a frame held
    /// a detection of each.
    until: Timestamp,
}

/// All merged pairs that can still be asked for, in the order of their merges.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PreMergeTracks<F>(Vec<Pair<F>>);

impl<F> Default for PreMergeTracks<F> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<F: Filter> PreMergeTracks<F> {
    /// Keeps two tracks that a frame captured at `merged_at` is about to merge, if an earlier frame resolved them.
    pub fn note(&mut self, older: &Track<F>, younger: &Track<F>, merged_at: Timestamp) {
        if let Some(resolved_at) = older.last_detected_with(younger) {
            let until = resolved_at.max(merged_at - Span::from_nanos(1));
            self.0.push(Pair { tracks: [older.clone(), younger.clone()], until });
        }
    }

    /// Replays and folds all tracks ([`Track::replay`], [`Track::fold`]); forgets pairs older than the horizon.
    pub fn maintain(&mut self, horizon: &Horizon, context: &TrackContext<'_>) {
        self.0.retain(|pair| pair.until >= horizon.at);
        for track in self.0.iter_mut().flat_map(|pair| &mut pair.tracks) {
            track.replay(context);
            track.fold(horizon, context);
        }
    }

    /// The tracks as of a time: the `present` ones, with those that were merged since in place of what they became; by
    /// id.
    pub fn with_present<'a>(&'a self, present: &'a [Track<F>], at: Timestamp) -> Vec<&'a Track<F>> {
        let mut all: Vec<&Track<F>> = Vec::with_capacity(present.len());
        let merged_since = self.0.iter().filter(|pair| at <= pair.until);
        all.extend(merged_since.flat_map(|pair| &pair.tracks).chain(present));
        // Stable: of several merges of one track the first comes first, and so what was there before it.
        all.sort_by_key(|track| track.id);
        all.dedup_by_key(|track| track.id);
        all
    }
}
