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
        let list = self.follow(entry)?;
        let hub = Topic::of(&entry.key).and_then(|topic| topic.hub());
        Ok(list.filter(|list| {
            if hub != Some(list.hub) {
                tracing::warn!(key = entry.key, hub = %list.hub, "a list in the name of another hub is not used");
            }
            hub == Some(list.hub)
        }))
    }

    fn follow(&mut self, entry: &Entry) -> Result<Option<FusedFrame>, WireError> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::id::NetworkId;
    use v2x_common::keys::Keys;
    use v2x_common::time::Timestamp;

    #[test]
    fn a_list_in_the_name_of_another_hub_than_its_keys_is_not_used() {
        let keys = Keys::new(NetworkId::new("demo").unwrap());
        let [north, south] = ["north", "south"].map(|name| HubId::new(name).unwrap());
        let list = FusedFrame {
            hub: north,
            lineage: 1,
            sequence: 0,
            fused_at: Timestamp::EPOCH,
            map_frame: None,
            objects: Vec::new(),
            agents: Vec::new(),
            includes: Vec::new(),
        };
        let mut payload = Vec::new();
        wire::fused::encode(&list, &mut payload).unwrap();
        let mut lists = Lists::default();
        let mut under = |key: String| {
            let entry = Entry {
                received_at: Timestamp::EPOCH,
                key,
                encoding: String::new(),
                payload: payload.clone(),
            };
            lists.handle(&entry).unwrap()
        };
        assert!(under(keys.fused(&north)).is_some());
        assert_eq!([under(keys.fused(&south)), under(keys.all_fused())], [None, None]);
    }
}
