//! Track continuity: track ids and id switches of each true object.

use crate::data::scene::TrueBox;
use crate::score::matching::{Matching, Outcome};
use crate::score::moments::Moments;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use v2x_agent::truth::ObjectId;
use v2x_common::fused::FusedObject;
use v2x_common::id::TrackId;

/// Track continuity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackSummary {
    /// True objects that were matched at least once.
    pub objects: u64,
    /// Track ids per matched object; 1 is best.
    pub ids_per_object: Option<f64>,
    /// How often an object was matched by another track than before.
    pub id_switches: u64,
}

/// The tracks that matched each true object.
#[derive(Debug, Default)]
pub(crate) struct TrackContinuity {
    latest: BTreeMap<ObjectId, TrackId>,
    tracks: BTreeMap<ObjectId, BTreeSet<TrackId>>,
    switches: u64,
}

impl TrackContinuity {
    /// Adds a frame's objects and their matches.
    pub(crate) fn add(&mut self, objects: &[FusedObject], truth: &[TrueBox], matching: &Matching) {
        for (fused, outcome) in objects.iter().zip(&matching.outcomes) {
            let Outcome::Matched(place) = *outcome else { continue };
            let id = truth[place].id;
            self.tracks.entry(id).or_default().insert(fused.track);
            let before = self.latest.insert(id, fused.track);
            self.switches += u64::from(before.is_some_and(|before| before != fused.track));
        }
    }

    /// The figures so far.
    pub(crate) fn summary(&self) -> TrackSummary {
        let mut ids = Moments::default();
        for tracks in self.tracks.values() {
            #[expect(clippy::cast_precision_loss, reason = "a count of tracks")]
            ids.add(Some(tracks.len() as f64));
        }
        TrackSummary {
            objects: self.tracks.len() as u64,
            ids_per_object: ids.mean(),
            id_switches: self.switches,
        }
    }
}
