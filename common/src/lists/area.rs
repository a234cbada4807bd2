//! The list of an area, from those of its tiles.

use super::follower::{FollowError, FrameNumber};
use crate::fused::{FusedFrame, FusedObject};
use crate::id::TrackId;
use crate::tile::Tile;
use crate::time::Span;
use std::collections::BTreeMap;

/// A tile of which nothing has come for so long is empty: its last frame was lost. A hub sends a tile that holds objects with
/// every list, ten times a second by its defaults.
const FORGOTTEN_AFTER: Span = Span::from_millis(1500);

/// The objects of an area: the newest frame of each of its tiles.
///
/// For one hub. The frames of one list come one after the other: in between, an object that has just crossed an edge is taken
/// from the newer frame, or is in none for a moment.
#[derive(Clone, Debug, Default)]
pub struct AreaFollower {
    tiles: BTreeMap<Tile, FusedFrame>,
    /// The newest frame, without its objects.
    newest: Option<FusedFrame>,
}

impl AreaFollower {
    /// Takes in the frame of a tile.
    ///
    /// # Errors
    /// Where the frame is not newer than the tile's.
    pub fn handle(&mut self, tile: Tile, frame: FusedFrame) -> Result<(), FollowError> {
        let number = FrameNumber::of(&frame);
        if self.newest.as_ref().is_some_and(|newest| !FrameNumber::of(newest).is_of_run(&number)) {
            *self = Self::default();
        }
        if let Some(held) = self.tiles.get(&tile).map(FrameNumber::of)
            && number.sequence <= held.sequence
        {
            return Err(FollowError::NotNewer { frame: number, held });
        }
        if self.newest.as_ref().is_none_or(|newest| newest.sequence <= number.sequence) {
            self.tiles.retain(|_, held| frame.fused_at - held.fused_at <= FORGOTTEN_AFTER);
            self.newest = Some(frame.without_lists());
        }
        self.tiles.insert(tile, frame);
        Ok(())
    }

    /// The list of the area, with the head of its newest frame; `None` before the first one. Objects are by track id, each as of
    /// its tile's time, which can be older.
    pub fn list(&self) -> Option<FusedFrame> {
        let mut objects: BTreeMap<TrackId, (u64, &FusedObject)> = BTreeMap::new();
        for frame in self.tiles.values() {
            for object in &frame.objects {
                let held = objects.entry(object.track).or_insert((frame.sequence, object));
                // An object that has crossed an edge is in two tiles, until the frame of the one that it has left comes.
                if frame.sequence > held.0 {
                    *held = (frame.sequence, object);
                }
            }
        }
        let newest = self.newest.clone()?;
        Some(FusedFrame {
            objects: objects.into_values().map(|(_, object)| object.clone()).collect(),
            ..newest
        })
    }
}
