//! The list that samples give: each of them the whole list, what has changed in it, or a tile of it.

use std::collections::BTreeMap;
use v2x_common::fused::FusedFrame;
use v2x_common::id::HubId;
use v2x_common::keys::Topic;
use v2x_common::lists::{AreaFollower, DeltaFollower};
use v2x_common::recording::Entry;
use v2x_common::wire::{self, WireError};

/// What is held of the lists of each hub.
#[derive(Debug, Default)]
pub(super) struct Lists {
    deltas: BTreeMap<HubId, DeltaFollower>,
    areas: BTreeMap<HubId, AreaFollower>,
}

impl Lists {
    /// The list after a sample of fused objects; `None` where a message before it was lost, or the first key frame is still
    /// to come.
    pub(super) fn handle(&mut self, entry: &Entry) -> Result<Option<FusedFrame>, WireError> {
        let followed = match Topic::of(&entry.key) {
            Some(Topic::Delta(hub)) => {
                let update = wire::decode_update(&entry.encoding, &entry.payload)?;
                self.deltas.entry(hub).or_default().handle(update).cloned().map(Some)
            }
            Some(Topic::Tile(hub, tile)) => {
                let frame = wire::fused::decode(&entry.payload)?;
                let area = self.areas.entry(hub).or_default();
                area.handle(tile, frame).map(|()| area.list())
            }
            _ => return wire::fused::decode(&entry.payload).map(Some),
        };
        Ok(followed.unwrap_or_else(|error| {
            tracing::debug!(key = entry.key, %error, "list not followed");
            None
        }))
    }
}
