//! Roughly where each track is: what a frame's region is compared with. A hub has many tracks and a frame concerns few of
//! them, so that looking at each must cost no more than half a line of memory.

use crate::filter::Filter;
use crate::track::Track;
use serde::{Deserialize, Serialize};
use v2x_common::time::Timestamp;

/// Roughly where a track is.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Whereabouts {
    /// m.
    pub(super) position: [f64; 2],
    /// Larger standard deviation of the position along an axis, m.
    pub(super) sigma_m: f64,
    /// When it was there.
    pub(super) at: Timestamp,
    /// Whether every frame is compared with it, wherever it is. All versions of a track stay together: particles are resampled
    /// with all of theirs.
    pub(super) concerns_all: bool,
}

impl Whereabouts {
    pub(super) fn of<F: Filter>(track: &Track<F>) -> Self {
        Self { concerns_all: !track.holders.is_all(), ..Self::of_state(&track.latest().state) }
    }

    pub(super) fn of_state<F: Filter>(state: &F) -> Self {
        let (position, sigma_m) = state.rough_position();
        Self { position, sigma_m, at: state.at(), concerns_all: false }
    }
}

/// The whereabouts of all tracks, by their place in the track store.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct AllWhereabouts {
    known: Vec<Whereabouts>,
    /// Places of tracks that may have changed.
    changed: Vec<usize>,
    /// Whether all may have changed.
    is_stale: bool,
}

impl AllWhereabouts {
    /// None.
    pub(super) const fn new() -> Self {
        Self { known: Vec::new(), changed: Vec::new(), is_stale: false }
    }

    /// A track may change.
    pub(super) fn note_changed(&mut self, place: usize) {
        if !self.is_stale {
            self.changed.push(place);
        }
    }

    /// All tracks may change, or get other places.
    pub(super) fn note_all_changed(&mut self) {
        self.changed.clear();
        self.is_stale = true;
    }

    /// Those of the tracks as they are now.
    pub(super) fn refreshed<F: Filter>(&mut self, tracks: &[Track<F>]) -> &[Whereabouts] {
        if self.is_stale || self.changed.len() > tracks.len() {
            self.known.clear();
        }
        for place in self.changed.drain(..) {
            if let (Some(known), Some(track)) = (self.known.get_mut(place), tracks.get(place)) {
                *known = Whereabouts::of(track);
            }
        }
        self.is_stale = false;
        let new = &tracks[self.known.len().min(tracks.len())..];
        self.known.extend(new.iter().map(Whereabouts::of));
        &self.known
    }
}
