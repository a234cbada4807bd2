//! The `[hub.tiles]` table: where on the earth the map frame is, and how large tiles are.

use crate::fusion::SettingsError;
use crate::fusion::table::within;
use serde::Deserialize;
use v2x_common::tile::{Geodetic, LocalPlane, MAX_LATITUDE_DEG, MAX_ZOOM, Zoom};

/// As it is typed.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TilesTable {
    #[serde(default = "default_zoom")]
    zoom: u8,
    latitude_deg: f64,
    longitude_deg: f64,
}

/// Tiles of 402 m at 49° north.
const fn default_zoom() -> u8 {
    16
}

/// Where on the earth the map frame is, and how large the tiles are in which its objects are published.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileSettings {
    /// The plane of the map frame.
    pub plane: LocalPlane,
    /// The zoom of the tiles.
    pub zoom: Zoom,
}

impl TilesTable {
    pub(super) fn check(self) -> Result<TileSettings, SettingsError> {
        let Self { zoom, latitude_deg, longitude_deg } = self;
        within("tiles.latitude_deg", latitude_deg, -MAX_LATITUDE_DEG..=MAX_LATITUDE_DEG, "-85.05 to 85.05")?;
        within("tiles.longitude_deg", longitude_deg, -180.0..=180.0, "-180 to 180")?;
        let out_of_range = SettingsError::OutOfRange {
            field: "tiles.zoom",
            value: f64::from(zoom),
            expected: const {
                assert!(MAX_ZOOM == 26);
                "1 to 26"
            },
        };
        let zoom = Zoom::new(zoom).ok_or(out_of_range)?;
        Ok(TileSettings { plane: LocalPlane::new(Geodetic { latitude_deg, longitude_deg }), zoom })
    }
}
