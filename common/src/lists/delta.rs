//! What has changed in a list since its key frame.

use super::tolerance::Tolerance;
use crate::fused::{FusedFrame, FusedObject};
use crate::id::{HubId, MapFrame, TrackId};
use crate::time::{Span, Timestamp};
use std::collections::{BTreeMap, BTreeSet};

/// The list at one time, by what a key frame says of it: objects that are not listed are where their key frame has them
/// move at constant velocity. Each delta frame is relative to the key frame and to no other delta frame, so that a lost one
/// costs nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct DeltaFrame {
    /// The hub.
    pub hub: HubId,
    /// The hub's lineage, of the key frame, too.
    pub lineage: u32,
    /// Number of the fused frame whose list this is.
    pub sequence: u64,
    /// The hub time for which the list holds.
    pub fused_at: Timestamp,
    /// The coordinate frame of all positions.
    pub map_frame: Option<MapFrame>,
    /// Number of the key frame.
    pub key_sequence: u64,
    /// The objects that are new, or not where the key frame has them: whole, without contributors.
    pub changed: Vec<FusedObject>,
    /// The tracks of the key frame that are not in the list.
    pub gone: Vec<TrackId>,
}

/// One message of a list by what changes.
#[derive(Clone, Debug, PartialEq)]
pub enum ListUpdate {
    /// The whole list.
    Key(FusedFrame),
    /// What has changed since the key frame.
    Delta(DeltaFrame),
}

impl DeltaFrame {
    /// What has changed beyond the tolerance since the key frame.
    pub fn between(key: &FusedFrame, list: &FusedFrame, tolerance: &Tolerance) -> Self {
        let elapsed = list.fused_at - key.fused_at;
        let known: BTreeMap<_, _> = key.objects.iter().map(|object| (object.track, object)).collect();
        let is_as_known = |live: &&FusedObject| {
            let known = known.get(&live.track).map(|object| extrapolated(object, elapsed));
            known.is_some_and(|taken| tolerance.allows(&taken, live))
        };
        let live: BTreeSet<_> = list.objects.iter().map(|object| object.track).collect();
        let changed = list.objects.iter().filter(|live| !is_as_known(live));
        Self {
            hub: list.hub,
            lineage: list.lineage,
            sequence: list.sequence,
            fused_at: list.fused_at,
            map_frame: list.map_frame,
            key_sequence: key.sequence,
            changed: changed.map(FusedObject::without_contributors).collect(),
            gone: known.into_keys().filter(|track| !live.contains(track)).collect(),
        }
    }
}

/// The object after a time, as a consumer takes it to be: it moves at constant velocity, and all else stays. It has not been
/// measured meanwhile.
pub fn extrapolated(object: &FusedObject, by: Span) -> FusedObject {
    let mut moved = object.clone();
    let (vx, vy) = object.velocity;
    moved.bev.x += vx * by.as_secs_f64();
    moved.bev.y += vy * by.as_secs_f64();
    moved.age = object.age + by;
    moved
}
