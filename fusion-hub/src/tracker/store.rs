//! All tracks of one hub.

use super::whereabouts::{AllWhereabouts, Whereabouts};
use crate::filter::Filter;
use crate::track::{Evidence, Horizon, Replayer, Track, TrackContext};
use crate::values::{Coast, Measurement, ParticleSet, PositionInnovation};
use serde::{Deserialize, Serialize};
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// Most tracks, published or not.
const MAX_TRACKS: usize = 65_536;
/// Contributors are named for this long after their last detection, at least.
const CONTRIBUTORS_NAMED_FOR: Span = Span::from_millis(1500);
/// Most deleted tracks whose memory is kept for new ones.
const MAX_SPARE: usize = 4096;

/// What is kept of tracks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeptTracks {
    /// Evidence since then is not folded; `None` where none is folded now.
    pub(crate) evidence: Option<Horizon>,
    /// Tracks detected since then are kept, and for the time of coasting.
    pub(crate) detected_from: Timestamp,
    /// How long objects coast.
    pub(crate) coast: Coast,
}

impl KeptTracks {
    /// When a track must have been detected last to be kept.
    pub(super) fn detected_from<F: Filter>(&self, track: &Track<F>) -> Timestamp {
        self.detected_from - self.coast.remembered(track.latest().interval_s)
    }
}

/// All tracks, by id. Where association particles differ about a track it has several versions, next to each other.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound(serialize = "F: Serialize", deserialize = "F: Deserialize<'de>"))]
pub(crate) struct TrackStore<F> {
    tracks: Vec<Track<F>>,
    /// Of the tracks, by place.
    whereabouts: AllWhereabouts,
    /// Places of tracks with late evidence. The memory is used again.
    stale: Vec<usize>,
    #[serde(skip)]
    replayer: Replayer<F>,
    /// Of the tracks that are being updated, by number. The memory is used again.
    #[serde(skip)]
    innovations: Vec<(usize, PositionInnovation)>,
    #[serde(skip)]
    spare: Vec<Track<F>>,
    lineage: u32,
    next_counter: u32,
    initiations_refused: u64,
}

impl<F: Filter> TrackStore<F> {
    /// An empty store, which makes track ids of this lineage.
    pub(crate) fn new(lineage: u32) -> Self {
        Self {
            tracks: Vec::new(),
            whereabouts: AllWhereabouts::new(),
            stale: Vec::new(),
            replayer: Replayer::default(),
            innovations: Vec::new(),
            spare: Vec::new(),
            lineage,
            next_counter: 0,
            initiations_refused: 0,
        }
    }

    /// Every track, all versions of it.
    pub(crate) fn all(&self) -> &[Track<F>] {
        &self.tracks
    }

    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Track<F>> {
        self.whereabouts.note_all_changed();
        self.tracks.iter_mut()
    }

    /// Every track with roughly where it is.
    pub(super) fn with_whereabouts(&mut self) -> (&[Track<F>], &[Whereabouts]) {
        (&self.tracks, self.whereabouts.refreshed(&self.tracks))
    }

    pub(crate) fn get(&self, index: usize) -> &Track<F> {
        &self.tracks[index]
    }

    pub(crate) fn get_mut(&mut self, index: usize) -> &mut Track<F> {
        self.whereabouts.note_changed(index);
        &mut self.tracks[index]
    }

    /// Updates the states of some tracks by measurements; `take` is called with each, its number in the list and the innovation.
    pub(super) fn update_some(
        &mut self,
        some: &[(usize, Measurement)],
        mut take: impl FnMut(&mut Track<F>, usize, PositionInnovation),
    ) {
        let Self { tracks, innovations, .. } = self;
        innovations.clear();
        F::update_some(tracks, some, |number, innovation| innovations.push((number, innovation)));
        for (number, innovation) in innovations {
            take(&mut tracks[some[*number].0], *number, *innovation);
        }
    }

    /// How many tracks there are to the leading particle.
    pub(crate) fn n_leading(&self) -> usize {
        self.tracks.iter().filter(|track| track.holders.leads()).count()
    }

    /// Tracks that were not initiated because there was no room.
    pub(crate) const fn initiations_refused(&self) -> u64 {
        self.initiations_refused
    }

    /// Whether there is a track of this id.
    pub(crate) fn contains(&self, id: TrackId) -> bool {
        self.tracks.binary_search_by_key(&id, |track| track.id).is_ok()
    }

    /// Whether there is room for another track.
    pub(crate) const fn is_full(&self) -> bool {
        self.tracks.len() >= MAX_TRACKS
    }

    /// Initiates a track with a detection; `id` is a known identity of it, else it gets a new one. `None` where there
    /// is no room, which is counted.
    pub(crate) fn initiate(
        &mut self,
        detection: Evidence,
        id: impl FnOnce() -> Option<TrackId>,
        context: &TrackContext<'_>,
    ) -> Option<&mut Track<F>> {
        if self.is_full() || self.next_counter == u32::MAX {
            self.initiations_refused += 1;
            return None;
        }
        let id = id().unwrap_or_else(|| {
            self.next_counter += 1;
            TrackId::new(self.lineage, self.next_counter - 1)
        });
        self.whereabouts.note_changed(self.tracks.len());
        self.tracks.push(Track::new(id, detection, self.spare.pop(), context));
        self.tracks.last_mut()
    }

    /// Adds a version of a track for these particles, out of order; its index.
    pub(crate) fn add_version(&mut self, of: usize, holders: ParticleSet) -> usize {
        let version = self.tracks[of].copied(holders, self.spare.pop());
        self.whereabouts.note_changed(self.tracks.len());
        self.tracks.push(version);
        self.tracks.len() - 1
    }

    /// Deletes versions that no particle holds, and restores the order by id.
    pub(crate) fn order(&mut self) {
        self.whereabouts.note_all_changed();
        let mut kept = 0;
        for index in 0..self.tracks.len() {
            if !self.tracks[index].holders.is_empty() {
                if kept < index {
                    self.tracks.swap(kept, index);
                }
                kept += 1;
            }
        }
        self.spare.extend(self.tracks.drain(kept..));
        if !self.tracks.is_sorted_by_key(|track| track.id) {
            self.tracks.sort_by_key(|track| track.id);
        }
    }

    /// Keeps of a track only the version of the leading particle, for all particles.
    pub(crate) fn keep_leading(&mut self, id: TrackId) {
        self.whereabouts.note_all_changed();
        self.tracks.retain(|track| track.id != id || track.holders.leads());
        let start = self.tracks.partition_point(|track| track.id < id);
        for track in self.tracks[start..].iter_mut().take_while(|track| track.id == id) {
            track.holders = ParticleSet::ALL;
        }
    }

    /// Copies of all versions of a track.
    pub(crate) fn copies_of(&mut self, id: TrackId, copies: &mut Vec<Track<F>>) {
        let start = self.tracks.partition_point(|track| track.id < id);
        for version in self.tracks[start..].iter().take_while(|track| track.id == id) {
            copies.push(version.copied(version.holders, self.spare.pop()));
        }
    }

    /// Replaces tracks by the copies that have their ids.
    pub(crate) fn restore(&mut self, copies: &mut Vec<Track<F>>) {
        if copies.is_empty() {
            return;
        }
        self.whereabouts.note_all_changed();
        let is_replaced = |track: &mut Track<F>| copies.iter().any(|copy| copy.id == track.id);
        self.spare.extend(self.tracks.extract_if(.., is_replaced));
        self.tracks.append(copies);
        self.tracks.sort_by_key(|track| track.id);
    }

    /// Deletes tracks.
    pub(crate) fn delete_where(&mut self, is_deleted: impl Fn(&Track<F>) -> bool) {
        self.whereabouts.note_all_changed();
        self.spare.extend(self.tracks.extract_if(.., |track| is_deleted(track)));
    }

    /// Removes the younger of two tracks, for its evidence to be taken over by the older one; with the index of that.
    /// `None` unless there are both.
    pub(crate) fn split_off(&mut self, older: TrackId, younger: TrackId) -> Option<(usize, Track<F>)> {
        let [older, younger] =
            [older, younger].map(|id| self.tracks.binary_search_by_key(&id, |track| track.id));
        let (Ok(older), Ok(younger)) = (older, younger) else { return None };
        self.whereabouts.note_all_changed();
        Some((older, self.tracks.remove(younger)))
    }

    /// Replays late evidence.
    pub(crate) fn replay(&mut self, context: &TrackContext<'_>) {
        let Self { tracks, whereabouts, stale, replayer, .. } = self;
        stale.clear();
        stale.extend(tracks.iter().enumerate().filter(|(_, track)| track.is_stale()).map(|(place, _)| place));
        stale.iter().for_each(|place| whereabouts.note_changed(*place));
        replayer.replay(tracks, stale, context);
    }

    /// Replays late evidence, folds what is older than the horizon, and deletes tracks that were detected too long ago;
    /// `on_deleted` is called with each of them first.
    pub(crate) fn maintain(
        &mut self,
        kept_tracks: &KeptTracks,
        context: &TrackContext<'_>,
        mut on_deleted: impl FnMut(&Track<F>),
    ) {
        self.replay(context);
        let mut kept = 0;
        for index in 0..self.tracks.len() {
            let track = &mut self.tracks[index];
            if let Some(evidence) = &kept_tracks.evidence {
                track.fold(evidence, context);
                track.thin_checkpoints(kept_tracks.detected_from);
            }
            let deleted_before = kept_tracks.detected_from(track);
            let last_measured_at = track.last_measured_at();
            track.forget_contributors(deleted_before.min(kept_tracks.detected_from - CONTRIBUTORS_NAMED_FOR));
            // However low its existence: late data can still be of it, and how often the hub publishes must not matter.
            if last_measured_at >= deleted_before {
                if kept < index {
                    self.tracks.swap(kept, index);
                }
                kept += 1;
            }
        }
        if kept < self.tracks.len() {
            self.whereabouts.note_all_changed();
        }
        self.tracks[kept..].iter().for_each(&mut on_deleted);
        self.spare.extend(self.tracks.drain(kept..));
        self.trim_spare();
    }

    /// Keeps the memory of a track that is not needed any more.
    pub(crate) fn recycle(&mut self, tracks: impl IntoIterator<Item = Track<F>>) {
        self.spare.extend(tracks);
    }

    /// Gives back memory that is unlikely to be used again.
    pub(crate) fn trim_spare(&mut self) {
        self.spare.truncate(MAX_SPARE);
    }
}
