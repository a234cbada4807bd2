//! Under which ids a hub publishes its tracks: those that the hub before it gave to the same objects.

use super::nearest::{Place, mutually_nearest};
use super::spent::Spent;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::fused::FusedFrame;
use v2x_common::id::TrackId;
use v2x_common::time::{Span, Timestamp};

/// A pair that was found is kept as long as it is within so many gates: two objects that pass each other keep theirs.
const KEPT_WITHIN: f64 = 2.0;
/// The own list and that of the other hub are for about the same time; with others nothing is compared.
const COMPARABLE: Span = Span::from_millis(500);
/// So long after the last list of the other hub its objects are looked for among own ones that have no name.
const LOOKED_FOR: Span = Span::from_millis(1000);
/// A track that is not listed for so long is deleted: the longest coast and the longest Δmax are 60 s each.
const FORGOTTEN_AFTER: Span = Span::from_millis(150_000);

/// The ids under which the tracks of this hub are published.
///
/// An id means one object for ever. A track has the id that the hub before gave to the same object; a track of which that hub
/// knew nothing has its own id, which no other hub gives, as it holds the lineage.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Names {
    /// Of a track that has another id or that the other hub has named.
    of: BTreeMap<TrackId, Named>,
    /// The track of each such id.
    track_of: BTreeMap<TrackId, TrackId>,
    /// Own ids that another hub has given to something else.
    spent: Spent,
    /// Ids that were given in place of spent ones.
    n_fresh: u32,
    /// The own list that was made last while another hub published.
    at: Option<Timestamp>,
    own: Vec<Place>,
    /// The last list of the other hub.
    heard: Option<(Timestamp, Vec<Place>)>,
    #[serde(skip)]
    renamed: Option<FusedFrame>,
}

/// The id of a track.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Named {
    id: TrackId,
    /// When the track was listed last.
    listed_at: Timestamp,
}

impl Names {
    /// How many tracks have an id of another hub.
    pub(crate) fn count(&self) -> usize {
        self.of.len()
    }

    /// Takes in the own list while another hub publishes.
    pub(crate) fn note_own(&mut self, list: &FusedFrame) {
        self.at = Some(list.fused_at);
        self.own.clear();
        self.own.extend(list.objects.iter().map(Place::of));
        self.note_listed(list);
    }

    /// Takes in a list of the hub that publishes; its objects are compared with those of the own list.
    pub(crate) fn follow(&mut self, list: &FusedFrame, lineage: u32) {
        let Some(after) = self.at.map(|at| list.fused_at - at).filter(|after| after.abs() <= COMPARABLE)
        else {
            return;
        };
        let own: Vec<_> = self.own.iter().map(|place| place.after(after)).collect();
        let theirs: Vec<_> = list.objects.iter().map(Place::of).collect();
        self.heard = Some((list.fused_at, theirs.clone()));
        let places: BTreeMap<TrackId, &Place> = theirs.iter().map(|place| (place.track, place)).collect();
        let mut kept = BTreeSet::new();
        let mut open = Vec::new();
        for place in own {
            match self.of.get(&place.track).map(|named| named.id) {
                Some(id) if places.get(&id).is_some_and(|at| place.within(at, KEPT_WITHIN).is_some()) => {
                    kept.insert(id);
                }
                Some(id) => {
                    // Another object has this id by now.
                    if places.contains_key(&id) {
                        self.unname(place.track);
                    }
                    open.push(place);
                }
                None => open.push(place),
            }
        }
        let unclaimed: Vec<_> = theirs.into_iter().filter(|place| !kept.contains(&place.track)).collect();
        for (i, j) in mutually_nearest(&open, &unclaimed) {
            self.name(open[i].track, unclaimed[j].track, list.fused_at);
        }
        self.note_spent(list, lineage);
    }

    /// The list under the ids that are published, in their order.
    pub(crate) fn renamed<'a>(&'a mut self, list: &'a FusedFrame) -> &'a FusedFrame {
        self.look_for_heard(list);
        if self.of.is_empty() && self.spent.is_empty() {
            return list;
        }
        self.note_listed(list);
        let mut renamed = list.clone();
        for object in &mut renamed.objects {
            object.track = self.id_of(object.track, list.fused_at);
        }
        renamed.objects.sort_by_key(|object| object.track);
        self.renamed.insert(renamed)
    }

    /// After a takeover: what the other hub listed last may have a track here only now, or another one than before.
    fn look_for_heard(&mut self, list: &FusedFrame) {
        let Some((heard_at, heard)) = self.heard.take() else { return };
        let after = list.fused_at - heard_at;
        if after > LOOKED_FOR {
            return;
        }
        let listed: BTreeSet<TrackId> = list.objects.iter().map(|object| object.track).collect();
        // Until nothing near is left over: the same list has the same ids when it is made again.
        loop {
            let is_named = |track: &TrackId| self.of.contains_key(track);
            let own = list.objects.iter().filter(|object| !is_named(&object.track));
            let own: Vec<_> = own.map(|object| Place::of(object).after(-after)).collect();
            let is_missing = |place: &&Place| match self.track_of.get(&place.track) {
                Some(own) => !listed.contains(own),
                None => {
                    let id = place.track;
                    !listed.contains(&id) || is_named(&id) || self.spent.contains(id)
                }
            };
            let missing: Vec<_> = heard.iter().filter(is_missing).copied().collect();
            let pairs = mutually_nearest(&own, &missing);
            if pairs.is_empty() {
                break;
            }
            for (i, j) in pairs {
                self.name(own[i].track, missing[j].track, list.fused_at);
            }
        }
        self.heard = Some((heard_at, heard));
    }

    fn id_of(&mut self, track: TrackId, at: Timestamp) -> TrackId {
        if let Some(named) = self.of.get(&track) {
            return named.id;
        }
        if !self.spent.contains(track) && !self.track_of.contains_key(&track) {
            return track;
        }
        loop {
            // Tracks count up from 0: these count down.
            self.n_fresh += 1;
            let id = TrackId::new(track.lineage(), u32::MAX - self.n_fresh);
            if !self.track_of.contains_key(&id) && !self.spent.contains(id) {
                self.name(track, id, at);
                return id;
            }
        }
    }

    /// Gives an id to a track; whichever had it has its own again.
    fn name(&mut self, track: TrackId, id: TrackId, at: Timestamp) {
        self.unname(track);
        if let Some(other) = self.track_of.insert(id, track) {
            self.of.remove(&other);
        }
        self.of.insert(track, Named { id, listed_at: at });
    }

    fn unname(&mut self, track: TrackId) {
        if let Some(named) = self.of.remove(&track) {
            self.track_of.remove(&named.id);
        }
    }

    /// Own ids under which another hub publishes what is not the track of that id.
    fn note_spent(&mut self, list: &FusedFrame, lineage: u32) {
        let own_ids = list.objects.iter().map(|object| object.track).filter(|id| id.lineage() == lineage);
        for id in own_ids {
            if self.track_of.get(&id) != Some(&id) {
                self.spent.note(id);
            }
        }
    }

    fn note_listed(&mut self, list: &FusedFrame) {
        for object in &list.objects {
            if let Some(named) = self.of.get_mut(&object.track) {
                named.listed_at = list.fused_at;
            }
        }
        let Self { of, track_of, .. } = self;
        of.retain(|_, named| {
            let is_kept = list.fused_at - named.listed_at <= FORGOTTEN_AFTER;
            if !is_kept {
                track_of.remove(&named.id);
            }
            is_kept
        });
    }
}

#[cfg(test)]
mod tests;
