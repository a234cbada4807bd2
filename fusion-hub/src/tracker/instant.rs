//! The newest instant, so that its frames can be associated again.
//!
//! Evidence can be removed from a track again. What cannot be undone is copied before it changes: the versions of tracks
//! about which particles come to differ, since every frame resamples the particles.

use super::assign::Assigning;
use super::predict::Predictions;
use super::store::{KeptTracks, TrackStore};
use crate::filter::Filter;
use crate::particles::Outcome;
use crate::track::{Evidence, FrameSlot, Track, TrackContext};
use serde::{Deserialize, Serialize};
use v2x_common::id::TrackId;
use v2x_common::time::Timestamp;

/// The newest capture time of all frames, and what was before them.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct NewestInstant<F> {
    at: Timestamp,
    /// Whether its frames were the newest when they arrived, and nothing arrived in between.
    is_whole: bool,
    /// All versions of the tracks about which particles have come to differ, as they were before, by id.
    before: Vec<Track<F>>,
    /// The ids of tracks whose first detections were retracted, by detection.
    ids: Vec<(FrameSlot, u16, TrackId)>,
    /// Frames that are still to be associated again, the last one first.
    retracted: Vec<FrameSlot>,
}

impl<F> Default for NewestInstant<F> {
    fn default() -> Self {
        Self {
            at: Timestamp::MIN,
            is_whole: false,
            before: Vec::new(),
            ids: Vec::new(),
            retracted: Vec::new(),
        }
    }
}

impl<F: Filter> NewestInstant<F> {
    /// Notes the capture time of a frame; `is_first` if no frame is of the same time or newer.
    pub(super) fn begin(&mut self, at: Timestamp, is_first: bool, tracks: &mut TrackStore<F>) {
        if at != self.at {
            tracks.recycle(self.before.drain(..));
            (self.at, self.is_whole) = (at, is_first);
        }
    }

    /// Whether particles can be set back to before the instant.
    pub(super) const fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Copies the tracks about which particles now come to differ.
    pub(super) fn copy_changing(
        &mut self,
        tracks: &mut TrackStore<F>,
        predictions: &Predictions<F>,
        assigning: &Assigning,
    ) {
        if !self.is_whole {
            return;
        }
        let mut outcomes = assigning.outcomes();
        for (place, index) in predictions.tracks().iter().enumerate() {
            let n = outcomes.iter().take_while(|outcome| outcome.col as usize == place).count();
            let (own, others) = outcomes.split_at(n);
            outcomes = others;
            let Track { id, holders, disputed_at, .. } = *tracks.get(*index);
            let is_same = |one: &Outcome| (one.holders, one.disputed_at) == (holders, disputed_at);
            let is_kept =
                matches!(own, [only] if is_same(only)) || self.before.iter().any(|copy| copy.id == id);
            if !is_kept {
                tracks.copies_of(id, &mut self.before);
            }
        }
    }

    /// Puts back what was before. Evidence of the instant in other tracks is still to be removed.
    pub(super) fn restore(&mut self, tracks: &mut TrackStore<F>) {
        tracks.restore(&mut self.before);
    }

    /// Notes frames that are to be associated again, in this order. It keeps the ids of the tracks that were initiated in
    /// this instant: a track that one of its detections initiates again gets its id back.
    pub(super) fn retract(&mut self, frames: &[FrameSlot], tracks: &TrackStore<F>) {
        self.retracted.extend(frames.iter().rev());
        for track in tracks.all().iter().filter(|track| track.initiated_at() == self.at) {
            let detections = track.evidence().filter(|item| item.is_detection());
            self.ids.extend(detections.map(|item| (item.frame, item.index(), track.id)));
        }
    }

    /// The next of the retracted frames. After the last one the ids that were not used again are forgotten.
    pub(super) fn next_retracted(&mut self) -> Option<FrameSlot> {
        if self.retracted.is_empty() {
            self.ids.clear();
        }
        self.retracted.pop()
    }

    /// The frames that are still to be associated again.
    pub(super) fn retracted(&self) -> &[FrameSlot] {
        &self.retracted
    }

    /// Forgets the ids of tracks that are still there, so that none is given twice.
    pub(super) fn forget_ids_in_use(&mut self, tracks: &TrackStore<F>) {
        self.ids.retain(|(.., id)| tracks.all().iter().all(|track| track.id != *id));
    }

    /// The id of the track that had this detection before it was retracted. It is returned once.
    pub(super) fn take_id(&mut self, first: &Evidence) -> Option<TrackId> {
        let is_it =
            |(frame, index, _): &&(FrameSlot, u16, TrackId)| (*frame, *index) == (first.frame, first.index());
        let (.., id) = *self.ids.iter().find(is_it)?;
        self.ids.retain(|(.., other)| *other != id);
        Some(id)
    }

    /// Forgets two tracks that are being merged: a merge is not undone.
    pub(super) fn forget(&mut self, ids: [TrackId; 2]) {
        self.before.retain(|track| !ids.contains(&track.id));
    }

    /// Forgets copies of tracks that are being deleted.
    pub(super) fn forget_where(&mut self, is_deleted: impl Fn(&Track<F>) -> bool) {
        self.before.retain(|track| !is_deleted(track));
    }

    /// Maintains the copies as the tracks are ([`TrackStore::maintain`]).
    pub(super) fn maintain(&mut self, kept: &KeptTracks, context: &TrackContext<'_>) {
        self.before.retain(|track| track.last_measured_at() >= kept.detected_from(track));
        for track in &mut self.before {
            track.replay(context);
            if let Some(evidence) = &kept.evidence {
                track.fold(evidence, context);
            }
        }
    }
}
