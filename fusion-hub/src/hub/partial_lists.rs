//! Publishes the lists that cost less than the whole one, each only while somebody subscribes to it.

use super::delta_stream::{DeltaStream, plain};
use super::encoding::encode_list;
use super::on_demand::Parts;
use super::tile_lists::TileLists;
use super::tile_settings::TileSettings;
use v2x_common::fused::FusedFrame;
use v2x_common::lists::ListUpdate;
use v2x_common::wire;

/// The streams, and how much was put.
pub(super) struct PartialLists {
    delta: DeltaStream,
    /// Where the settings say where on the earth the map frame is.
    tiles: Option<TileLists>,
    delta_frames: u64,
    tile_frames: u64,
}

impl PartialLists {
    pub(super) fn new(tiles: Option<TileSettings>) -> Self {
        Self {
            delta: DeltaStream::default(),
            tiles: tiles.map(TileLists::new),
            delta_frames: 0,
            tile_frames: 0,
        }
    }

    /// Key frames and delta frames put, in either codec.
    pub(super) const fn delta_frames(&self) -> u64 {
        self.delta_frames
    }

    /// Frames of tiles put, in either codec.
    pub(super) const fn tile_frames(&self) -> u64 {
        self.tile_frames
    }

    /// Another hub has published until now: consumers have the objects of its last list.
    pub(super) fn go_on_after(&mut self, list: &FusedFrame) {
        if let Some(tiles) = &mut self.tiles {
            tiles.next(plain(list));
        }
    }

    /// Another hub publishes from now on.
    pub(super) fn forget(&mut self) {
        self.delta.forget();
        if let Some(tiles) = &mut self.tiles {
            tiles.forget();
        }
    }

    /// Publishes a list for whose objects the wire has room.
    pub(super) async fn publish(&mut self, frame: &FusedFrame, parts: &Parts) -> anyhow::Result<()> {
        let outcome = self.publish_delta(frame, parts).await;
        self.publish_tiles(frame, parts).await.and(outcome)
    }

    async fn publish_delta(&mut self, frame: &FusedFrame, parts: &Parts) -> anyhow::Result<()> {
        if !parts.delta.is_wanted() && !parts.delta_json.is_wanted() {
            self.delta.forget();
            return Ok(());
        }
        let update = self.delta.next(&plain(frame))?;
        if parts.delta.is_wanted() {
            parts.delta.put(postcard(&update)?).await?;
            self.delta_frames += 1;
        }
        if parts.delta_json.is_wanted() {
            parts.delta_json.put(json(&update)?).await?;
            self.delta_frames += 1;
        }
        Ok(())
    }

    async fn publish_tiles(&mut self, frame: &FusedFrame, parts: &Parts) -> anyhow::Result<()> {
        let Some(tiles) = &mut self.tiles else { return Ok(()) };
        let (wanted, json_wanted) = (parts.tiles.is_wanted(), parts.tiles_json.is_wanted());
        if !wanted && !json_wanted {
            tiles.forget();
            return Ok(());
        }
        for (tile, list) in tiles.next(plain(frame)) {
            let [key, json_key] = parts.keys_of(tile);
            if wanted {
                let mut bytes = Vec::new();
                encode_list(&list, &mut bytes)?;
                parts.tiles.put(key, bytes).await?;
                self.tile_frames += 1;
            }
            if json_wanted {
                parts.tiles_json.put(json_key, wire::json::encode_fused(&list)?).await?;
                self.tile_frames += 1;
            }
        }
        Ok(())
    }
}

fn postcard(update: &ListUpdate) -> Result<Vec<u8>, wire::WireError> {
    let mut bytes = Vec::new();
    match update {
        ListUpdate::Key(frame) => wire::fused::encode(frame, &mut bytes)?,
        ListUpdate::Delta(delta) => wire::delta::encode(delta, &mut bytes)?,
    }
    Ok(bytes)
}

fn json(update: &ListUpdate) -> Result<Vec<u8>, wire::WireError> {
    match update {
        ListUpdate::Key(frame) => wire::json::encode_fused(frame),
        ListUpdate::Delta(delta) => wire::json::encode_delta(delta),
    }
}
