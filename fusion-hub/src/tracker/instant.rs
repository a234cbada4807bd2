//! What is kept so that the frames of the newest instant can be taken back.
//!
//! Evidence can be taken out of a track again. What cannot be undone is kept as it was before: particles that were
//! drawn again by a frame's likelihood, and the versions of tracks that were lost by it.

use crate::filter::Filter;
use crate::frames::{FrameSlot, LOOK, Piece};
use crate::particles::Outcome;
use crate::track::{Records, Track};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// The newest instant, and what was before it.
#[derive(Debug)]
pub(super) struct Instant<F> {
    at: Timestamp,
    /// Whether its frames were the newest when they came, and nothing came in between.
    is_whole: bool,
    /// All versions of the tracks of which particles have come to hold something else, by id.
    before: Vec<Track<F>>,
    /// The names of tracks whose births were taken back, by what they were reported by.
    names: Vec<(FrameSlot, u16, TrackId)>,
    /// Frames that are still to be associated again, the last one first.
    taken_back: Vec<FrameSlot>,
}

impl<F> Default for Instant<F> {
    fn default() -> Self {
        Self {
            at: Timestamp::MIN,
            is_whole: false,
            before: Vec::new(),
            names: Vec::new(),
            taken_back: Vec::new(),
        }
    }
}

impl<F: Filter> Instant<F> {
    /// Takes note of a frame's time; `is_first` if there is no other frame of that time, nor a newer one.
    pub(super) fn begin(&mut self, at: Timestamp, is_first: bool, spare: &mut Vec<Track<F>>) {
        if at != self.at {
            spare.append(&mut self.before);
            (self.at, self.is_whole) = (at, is_first);
        }
    }

    /// Whether particles can be set back to what they were before.
    pub(super) fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Keeps the tracks of which particles now come to hold something else.
    pub(super) fn keep(
        &mut self,
        (tracks, places): (&[Track<F>], &[usize]),
        outcomes: &[Outcome],
        spare: &mut Vec<Track<F>>,
    ) {
        if !self.is_whole {
            return;
        }
        let mut outcomes = outcomes;
        for (col, place) in places.iter().enumerate() {
            let n = outcomes.iter().take_while(|outcome| outcome.col as usize == col).count();
            let (own, others) = outcomes.split_at(n);
            outcomes = others;
            let Track { id, holders, disputed_at, .. } = tracks[*place];
            let stays = |one: &Outcome| (one.holders, one.disputed_at) == (holders, disputed_at);
            if matches!(own, [only] if stays(only)) || self.before.iter().any(|kept| kept.id == id) {
                continue;
            }
            let start = tracks.partition_point(|track| track.id < id);
            let versions = tracks[start..].iter().take_while(|track| track.id == id);
            self.before.extend(versions.map(|track| track.copied(track.holders, spare.pop())));
        }
    }

    /// Puts back what was before. Evidence of the instant in other tracks is still to be taken back.
    pub(super) fn restore(&mut self, tracks: &mut Vec<Track<F>>, spare: &mut Vec<Track<F>>) {
        if self.before.is_empty() {
            return;
        }
        let is_kept = |track: &mut Track<F>| self.before.iter().any(|kept| kept.id == track.id);
        spare.extend(tracks.extract_if(.., is_kept));
        tracks.append(&mut self.before);
        tracks.sort_by_key(|track| track.id);
    }

    /// Has these frames associated again, in this order. What this instant's newborn are called is remembered: born
    /// again of a report that they had, they keep the name.
    pub(super) fn take_back(
        &mut self,
        frames: impl DoubleEndedIterator<Item = FrameSlot>,
        tracks: &[Track<F>],
    ) {
        self.taken_back.extend(frames.rev());
        for track in tracks.iter().filter(|track| track.born_at() == self.at) {
            let reports = track.evidence().filter(|piece| piece.index != LOOK);
            self.names.extend(reports.map(|piece| (piece.frame, piece.index, track.id)));
        }
    }

    /// The next of the frames that were taken back. After the last one what was not used again of names is gone.
    pub(super) fn next_taken_back(&mut self) -> Option<FrameSlot> {
        if self.taken_back.is_empty() {
            self.names.clear();
        }
        self.taken_back.pop()
    }

    /// The frames that are still to be associated again.
    pub(super) fn taken_back(&self) -> &[FrameSlot] {
        &self.taken_back
    }

    /// Forgets the names of tracks that live, so that none is given twice.
    pub(super) fn forget_names_of(&mut self, tracks: &[Track<F>]) {
        self.names.retain(|(.., name)| tracks.iter().all(|track| track.id != *name));
    }

    /// The name of what was born of this report, or had it soon after; once.
    pub(super) fn take_name(&mut self, birth: &Piece) -> Option<TrackId> {
        let is_it =
            |(frame, index, _): &&(FrameSlot, u16, TrackId)| (*frame, *index) == (birth.frame, birth.index);
        let (.., name) = *self.names.iter().find(is_it)?;
        self.names.retain(|(.., other)| *other != name);
        Some(name)
    }

    /// Forgets tracks that have become one: they stay so.
    pub(super) fn forget(&mut self, ids: [TrackId; 2]) {
        self.before.retain(|track| !ids.contains(&track.id));
    }

    /// As tracks are settled: frames that they refer to are forgotten.
    pub(super) fn settle(
        &mut self,
        gone: Timestamp,
        (horizon, slack): (Timestamp, Span),
        records: &Records<'_>,
    ) {
        self.before.retain(|track| track.last_measured_at() >= gone);
        for track in &mut self.before {
            track.replay(records);
            track.fold(horizon, slack, records);
        }
    }
}
