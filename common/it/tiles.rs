//! Places and their tiles against PROJ and mercantile: `oracles/make_tiles.py`.

use proptest::prelude::*;
use serde::Deserialize;
use std::collections::BTreeMap;
use v2x_common::tile::{Geodetic, LocalPlane, Tile, Zoom};

/// 1 mm on the earth, degrees: tiles of zoom 20 have 38 m.
const TOLERANCE_DEG: f64 = 1e-8;

#[derive(Deserialize)]
struct Oracle {
    places: Vec<Place>,
}

#[derive(Deserialize)]
struct Place {
    origin: (f64, f64),
    x: f64,
    y: f64,
    latitude_deg: f64,
    longitude_deg: f64,
    quadkeys: BTreeMap<u8, String>,
}

fn geodetic((latitude_deg, longitude_deg): (f64, f64)) -> Geodetic {
    Geodetic { latitude_deg, longitude_deg }
}

#[test]
fn places_and_quadkeys_are_those_of_proj_and_mercantile() {
    let oracle: Oracle = serde_json::from_str(include_str!("oracles/tiles.json")).unwrap();
    assert_eq!(oracle.places.len(), 84);
    for place in oracle.places {
        let got = LocalPlane::new(geodetic(place.origin)).geodetic(place.x, place.y);
        let near = |a: f64, b: f64| (a - b).abs() < TOLERANCE_DEG;
        assert!(
            near(got.latitude_deg, place.latitude_deg) && near(got.longitude_deg, place.longitude_deg),
            "{got:?} for {} {}",
            place.latitude_deg,
            place.longitude_deg
        );
        for (zoom, quadkey) in place.quadkeys {
            assert_eq!(Tile::of(got, Zoom::new(zoom).unwrap()).to_string(), quadkey);
        }
    }
}

proptest! {
    /// At 80° a parallel bends away from the plane's east by 1.1 km within 50 km.
    #[test]
    fn the_plane_keeps_directions_and_distances_near_its_origin(
        latitude_deg in -80.0..80.0f64, longitude_deg in -179.0..179.0f64, x in -5e4..5e4f64, y in -5e4..5e4f64
    ) {
        let origin = Geodetic { latitude_deg, longitude_deg };
        let got = LocalPlane::new(origin).geodetic(x, y);
        let (north_deg, east_deg) = (got.latitude_deg - latitude_deg, got.longitude_deg - longitude_deg);
        prop_assert!(north_deg * y >= 0.0 || y.abs() < 1500.0, "{} m north", y);
        prop_assert!(east_deg * x >= 0.0 || east_deg.abs() > 180.0, "{} m east", x);
        let at_origin = LocalPlane::new(origin).geodetic(0.0, 0.0);
        prop_assert!((at_origin.latitude_deg - latitude_deg).abs() < 1e-9);
        prop_assert!((at_origin.longitude_deg - longitude_deg).abs() < 1e-9);
    }

    #[test]
    fn a_place_far_beyond_the_horizon_has_a_tile_all_the_same(x in -1e8..1e8f64, y in -1e8..1e8f64) {
        let place = LocalPlane::new(geodetic((48.0, 11.0))).geodetic(x, y);
        prop_assert!(place.latitude_deg.abs() <= 90.0 && place.longitude_deg.abs() <= 180.0);
        prop_assert_eq!(Tile::of(place, Zoom::new(16).unwrap()).to_string().len(), 16);
    }
}
