//! Tiles of the map: places in the map frame, their latitude and longitude, and the tile of Web Mercator that holds them.

mod plane;
mod quadkey;

pub use plane::{Geodetic, LocalPlane};
pub use quadkey::{MAX_LATITUDE_DEG, MAX_ZOOM, Tile, TileError, Zoom};
