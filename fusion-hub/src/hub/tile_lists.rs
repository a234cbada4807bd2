//! The list by tiles of the map.

use super::tile_settings::TileSettings;
use std::collections::{BTreeMap, BTreeSet};
use v2x_common::fused::FusedFrame;
use v2x_common::tile::Tile;

/// Divides lists into tiles. Pure, except for its memory of the tiles that held objects.
#[derive(Debug)]
pub(super) struct TileLists {
    settings: TileSettings,
    /// The tiles of the newest list.
    occupied: BTreeSet<Tile>,
}

impl TileLists {
    pub(super) const fn new(settings: TileSettings) -> Self {
        Self { settings, occupied: BTreeSet::new() }
    }

    /// The objects of each tile that holds any, and one empty frame of each that did in the list before.
    pub(super) fn next(&mut self, list: FusedFrame) -> BTreeMap<Tile, FusedFrame> {
        let head = list.without_lists();
        let emptied = std::mem::take(&mut self.occupied);
        let mut frames = BTreeMap::new();
        for object in list.objects {
            let place = self.settings.plane.geodetic(object.bev.x, object.bev.y);
            let tile = Tile::of(place, self.settings.zoom);
            frames.entry(tile).or_insert_with(|| head.clone()).objects.push(object);
        }
        self.occupied = frames.keys().copied().collect();
        for tile in emptied {
            frames.entry(tile).or_insert_with(|| head.clone());
        }
        frames
    }

    /// Nobody subscribes: nobody has objects of tiles to drop.
    pub(super) fn forget(&mut self) {
        self.occupied.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::class::Class;
    use v2x_common::fused::FusedObject;
    use v2x_common::geometry::BevBox;
    use v2x_common::id::{HubId, TrackId};
    use v2x_common::tile::{Geodetic, LocalPlane, Zoom};
    use v2x_common::time::Timestamp;

    /// Tiles of 402 m, of which one begins 255 m west of the origin.
    fn tiles() -> TileLists {
        let plane = LocalPlane::new(Geodetic { latitude_deg: 48.137, longitude_deg: 11.575 });
        TileLists::new(TileSettings { plane, zoom: Zoom::new(16).unwrap() })
    }

    fn list(places: &[(u32, f64)]) -> FusedFrame {
        let object = |&(track, x): &(u32, f64)| {
            let bev = BevBox { x, y: 0.0, w: 1.0, d: 1.0, yaw: 0.0 };
            FusedObject::from_box(TrackId::new(1, track), Class::Car, bev)
        };
        FusedFrame {
            hub: HubId::new("hub").unwrap(),
            lineage: 1,
            sequence: 7,
            fused_at: Timestamp::EPOCH,
            map_frame: None,
            objects: places.iter().map(object).collect(),
            agents: Vec::new(),
            includes: Vec::new(),
        }
    }

    fn tracks(frames: &BTreeMap<Tile, FusedFrame>) -> Vec<Vec<u32>> {
        let of = |frame: &FusedFrame| frame.objects.iter().map(|object| object.track.counter()).collect();
        frames.values().map(of).collect()
    }

    #[test]
    fn every_object_is_in_the_frame_of_its_tile_with_the_number_and_time_of_the_list() {
        let frames = tiles().next(list(&[(1, 0.0), (2, 10.0), (3, 1000.0)]));
        assert_eq!(tracks(&frames), [vec![1, 2], vec![3]]);
        let origin: Tile = "1202300022131233".parse().unwrap();
        assert_eq!(frames.keys().next(), Some(&origin));
        assert!(frames.values().all(|frame| (frame.sequence, frame.fused_at) == (7, Timestamp::EPOCH)));
    }

    #[test]
    fn a_tile_that_became_empty_has_one_empty_frame() {
        let mut tiles = tiles();
        tiles.next(list(&[(1, 0.0), (2, 1000.0)]));
        assert_eq!(tracks(&tiles.next(list(&[(1, 0.0)]))), [vec![1], vec![]]);
        assert_eq!(tracks(&tiles.next(list(&[(1, 0.0)]))), [vec![1]]);
        tiles.forget();
        assert_eq!(tracks(&tiles.next(list(&[]))), [[0_u32; 0]; 0], "nobody has anything to drop");
    }
}
