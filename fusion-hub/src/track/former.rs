//! Tracks as they were before they were merged: where a sensor had told the two apart, a merge says that one of them
//! is gone, and nothing of the time before.

use super::{Records, Track};
use crate::filter::Filter;
use v2x_common::time::{Span, Timestamp};

/// Two tracks before they were merged.
#[derive(Clone, Debug)]
struct Pair<F> {
    /// The older one first.
    tracks: [Track<F>; 2],
    /// Up to here they were two: the last moment before the frame that decided the merge was captured, or when a frame
    /// reported both.
    until: Timestamp,
}

/// All of them that can still be asked for, by the time of the merge.
#[derive(Clone, Debug)]
pub struct Former<F>(Vec<Pair<F>>);

impl<F> Default for Former<F> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<F: Filter> Former<F> {
    /// Remembers two tracks that a frame captured at `merged_at` is about to merge, if an earlier one reported both.
    pub fn note(&mut self, older: &Track<F>, younger: &Track<F>, merged_at: Timestamp) {
        if let Some(beside) = older.last_beside(younger) {
            let until = beside.max(merged_at - Span::from_nanos(1));
            self.0.push(Pair { tracks: [older.clone(), younger.clone()], until });
        }
    }

    /// As [`Track::replay`] and [`Track::fold`], with all; forgets what is older than the horizon.
    pub fn settle(&mut self, horizon: Timestamp, slack: Span, records: &Records<'_>) {
        self.0.retain(|pair| pair.until >= horizon);
        for track in self.0.iter_mut().flat_map(|pair| &mut pair.tracks) {
            track.replay(records);
            track.fold(horizon, slack, records);
        }
    }

    /// The tracks that there were at a time, of those that there are, with those that were merged since; by number.
    pub fn with_present<'a>(&'a self, present: &'a [Track<F>], at: Timestamp) -> Vec<&'a Track<F>> {
        let mut all: Vec<&Track<F>> = Vec::with_capacity(present.len());
        let merged_since = self.0.iter().filter(|pair| at <= pair.until);
        all.extend(merged_since.flat_map(|pair| &pair.tracks).chain(present));
        // Stable: of what was merged several times the first merge comes first, and so what was there before it.
        all.sort_by_key(|track| track.id);
        all.dedup_by_key(|track| track.id);
        all
    }
}
