//! Tiles of Web Mercator (EPSG:3857) and their quadkeys: at each zoom every tile is divided into four.

use super::plane::Geodetic;
use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

/// The finest zoom: tiles of 0.6 m at the equator. Twice as many bits fit into [`Tile`].
pub const MAX_ZOOM: u8 = 26;
/// Web Mercator ends at this latitude, north and south, degrees: there the map is a square.
pub const MAX_LATITUDE_DEG: f64 = 85.051_128_779_806_6;

/// How often the earth is divided into four: 1 to [`MAX_ZOOM`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Zoom(u8);

impl Zoom {
    /// A checked zoom.
    pub const fn new(zoom: u8) -> Option<Self> {
        if zoom >= 1 && zoom <= MAX_ZOOM { Some(Self(zoom)) } else { None }
    }

    /// The number.
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// One tile. The order is that of the quadkeys as texts among tiles of one zoom.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tile {
    /// The digits of the quadkey, two bits each, the first one highest.
    digits: u64,
    zoom: u8,
}

/// Why a text is no quadkey.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TileError {
    /// No digit: the whole earth is no tile.
    #[error("a tile has at least one digit")]
    Empty,
    /// More digits than [`MAX_ZOOM`].
    #[error("a tile has at most {MAX_ZOOM} digits, not {0}")]
    TooLong(usize),
    /// A character that is no digit of a quadkey.
    #[error("tile {text:?} holds {character:?}; the digits of a tile are 0 to 3")]
    Digit {
        /// The text, cut to twice the longest tile.
        text: String,
        /// The first such character.
        character: char,
    },
}

impl Tile {
    /// The tile of this zoom that holds a place. Beyond [`MAX_LATITUDE_DEG`] it is the outermost one.
    pub fn of(place: Geodetic, zoom: Zoom) -> Self {
        let (x, y) = mercator(place);
        let (column, row) = (step(x, zoom), step(y, zoom));
        let digits = (0..zoom.0).rev().fold(0, |digits, bit| {
            let digit = (column >> bit & 1) | (row >> bit & 1) << 1;
            digits << 2 | u64::from(digit)
        });
        Self { digits, zoom: zoom.0 }
    }

    /// Its zoom: the number of its digits.
    pub const fn zoom(self) -> Zoom {
        Zoom(self.zoom)
    }

    /// The digits of its quadkey, 0 to 3, from the coarsest on.
    pub fn digits(self) -> impl Iterator<Item = u8> {
        (0..self.zoom).rev().map(move |place| u8::try_from(self.digits >> (2 * place) & 3).expect("two bits"))
    }

    /// Whether another tile is this one or a part of it.
    pub const fn contains(self, other: Self) -> bool {
        other.zoom >= self.zoom && other.digits >> (2 * (other.zoom - self.zoom)) == self.digits
    }
}

impl FromStr for Tile {
    type Err = TileError;
    fn from_str(text: &str) -> Result<Self, TileError> {
        let mut tile = Self { digits: 0, zoom: 0 };
        for character in text.chars() {
            let cut = || text.chars().take(2 * usize::from(MAX_ZOOM)).collect();
            let digit = character.to_digit(4).ok_or_else(|| TileError::Digit { text: cut(), character })?;
            if tile.zoom == MAX_ZOOM {
                return Err(TileError::TooLong(text.chars().count()));
            }
            tile = Self { digits: tile.digits << 2 | u64::from(digit), zoom: tile.zoom + 1 };
        }
        if tile.zoom == 0 { Err(TileError::Empty) } else { Ok(tile) }
    }
}

/// The quadkey.
impl fmt::Display for Tile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text: String = self.digits().map(|digit| char::from(b'0' + digit)).collect();
        f.pad(&text)
    }
}

impl fmt::Debug for Tile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The place on the map of Web Mercator, each axis from 0 to 1: east from longitude -180°, south from
/// [`MAX_LATITUDE_DEG`].
fn mercator(place: Geodetic) -> (f64, f64) {
    let latitude_deg = place.latitude_deg.clamp(-MAX_LATITUDE_DEG, MAX_LATITUDE_DEG);
    let sin = libm::sin(latitude_deg * PI / 180.0);
    let y = 0.5 - libm::log((1.0 + sin) / (1.0 - sin)) / (4.0 * PI);
    let turns = place.longitude_deg / 360.0 + 0.5;
    (turns - libm::floor(turns), y)
}

/// The column or row of a place between 0 and 1.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded to the steps before")]
fn step(place: f64, zoom: Zoom) -> u32 {
    let n_steps = f64::from(1_u32 << zoom.0);
    libm::floor(place * n_steps).clamp(0.0, n_steps - 1.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn zoom(zoom: u8) -> Zoom {
        Zoom::new(zoom).unwrap()
    }

    #[test]
    fn a_quadkey_is_read_as_it_is_written() {
        for text in ["0", "3", "1202", "12023101230123012301230123"] {
            let tile: Tile = text.parse().unwrap();
            assert_eq!((tile.to_string().as_str(), usize::from(tile.zoom().get())), (text, text.len()));
        }
    }

    #[test]
    fn a_text_that_is_no_quadkey_is_refused_by_its_character_or_length() {
        assert_eq!("".parse::<Tile>(), Err(TileError::Empty));
        let error = "1240".parse::<Tile>().unwrap_err();
        assert_eq!(error, TileError::Digit { text: "1240".to_owned(), character: '4' });
        let digits = usize::from(MAX_ZOOM) + 1;
        assert_eq!("0".repeat(digits).parse::<Tile>(), Err(TileError::TooLong(digits)));
    }

    #[test]
    fn beyond_the_map_of_web_mercator_the_outermost_tile_holds_a_place() {
        let row =
            |latitude_deg| Tile::of(Geodetic { latitude_deg, longitude_deg: -179.9 }, zoom(3)).to_string();
        assert_eq!(
            [row(90.0), row(MAX_LATITUDE_DEG), row(-MAX_LATITUDE_DEG), row(-90.0)],
            ["000", "000", "222", "222"]
        );
    }

    #[test]
    fn a_zoom_is_1_to_26() {
        assert_eq!(
            [0, 1, MAX_ZOOM, MAX_ZOOM + 1].map(|zoom| Zoom::new(zoom).is_some()),
            [false, true, true, false]
        );
    }

    proptest! {
        #[test]
        fn a_coarser_tile_of_a_place_contains_the_finer_one_and_begins_its_quadkey(
            latitude_deg in -89.0..89.0f64, longitude_deg in -180.0..180.0f64, coarse in 1..=13u8, finer in 0..=13u8
        ) {
            let place = Geodetic { latitude_deg, longitude_deg };
            let (outer, inner) = (Tile::of(place, zoom(coarse)), Tile::of(place, zoom(coarse + finer)));
            prop_assert!(outer.contains(inner) && (finer == 0 || !inner.contains(outer)));
            prop_assert!(inner.to_string().starts_with(&outer.to_string()));
        }

        #[test]
        fn a_tile_contains_another_exactly_where_its_quadkey_begins_the_others(a in "[0-3]{1,4}", b in "[0-3]{1,6}") {
            let (one, other): (Tile, Tile) = (a.parse().unwrap(), b.parse().unwrap());
            prop_assert_eq!(one.contains(other), b.starts_with(&a));
        }
    }
}
