//! The plane of the map frame on the earth: the tangent plane of WGS84 at the frame's origin.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Semi-major axis of WGS84, m (NIMA TR8350.2, table 3.1).
const A_M: f64 = 6_378_137.0;
/// Flattening of WGS84 (the same table).
const F: f64 = 1.0 / 298.257_223_563;
/// Semi-minor axis, m.
const B_M: f64 = A_M * (1.0 - F);
/// First eccentricity squared.
const E2: f64 = F * (2.0 - F);
/// Second eccentricity squared.
const EP2: f64 = E2 / (1.0 - E2);

/// A place on the earth, WGS84.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Geodetic {
    /// Latitude, degrees north, -90 to 90.
    pub latitude_deg: f64,
    /// Longitude, degrees east, -180 to 180.
    pub longitude_deg: f64,
}

/// A map frame whose origin (0, 0) is a place on the ellipsoid, x east and y north in the tangent plane there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalPlane {
    /// The origin in earth-centred, earth-fixed coordinates, m.
    origin_m: [f64; 3],
    /// The unit vectors east and north in the same coordinates.
    east: [f64; 3],
    north: [f64; 3],
}

impl LocalPlane {
    /// The plane that touches the ellipsoid at this place.
    pub fn new(origin: Geodetic) -> Self {
        let (sin_lat, cos_lat) = libm::sincos(origin.latitude_deg * PI / 180.0);
        let (sin_lon, cos_lon) = libm::sincos(origin.longitude_deg * PI / 180.0);
        Self {
            origin_m: earth_fixed(origin),
            east: [-sin_lon, cos_lon, 0.0],
            north: [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
        }
    }

    /// The place of a point (m east, m north) of the plane. Its height above the ellipsoid, 8 m at a distance of 10 km, is
    /// left out.
    pub fn geodetic(&self, x_m: f64, y_m: f64) -> Geodetic {
        geodetic([0, 1, 2].map(|axis| self.origin_m[axis] + x_m * self.east[axis] + y_m * self.north[axis]))
    }

    /// Straight distance of a place on the ellipsoid from the origin, m.
    pub fn distance_m(&self, place: Geodetic) -> f64 {
        let at = earth_fixed(place);
        libm::sqrt(
            (0..3).map(|axis| (at[axis] - self.origin_m[axis]) * (at[axis] - self.origin_m[axis])).sum(),
        )
    }

    /// The point (m east, m north) of the plane below or above a place on the ellipsoid.
    pub fn local(&self, place: Geodetic) -> (f64, f64) {
        let at = earth_fixed(place);
        let along = |unit: &[f64; 3]| (0..3).map(|axis| (at[axis] - self.origin_m[axis]) * unit[axis]).sum();
        (along(&self.east), along(&self.north))
    }
}

/// A place on the ellipsoid in earth-centred, earth-fixed coordinates, m.
fn earth_fixed(place: Geodetic) -> [f64; 3] {
    let (sin_lat, cos_lat) = libm::sincos(place.latitude_deg * PI / 180.0);
    let (sin_lon, cos_lon) = libm::sincos(place.longitude_deg * PI / 180.0);
    // Radius of curvature in the prime vertical.
    let n_m = A_M / libm::sqrt(1.0 - E2 * sin_lat * sin_lat);
    [n_m * cos_lat * cos_lon, n_m * cos_lat * sin_lon, n_m * (1.0 - E2) * sin_lat]
}

/// The place of a point in earth-centred, earth-fixed coordinates, m: Bowring's formula of 1976, which errs by less than
/// 1 µm within 10 km of the ellipsoid.
fn geodetic([x, y, z]: [f64; 3]) -> Geodetic {
    let axis_distance = libm::sqrt(x * x + y * y);
    let (sin_u, cos_u) = libm::sincos(libm::atan2(z * A_M, axis_distance * B_M));
    let latitude =
        libm::atan2(z + EP2 * B_M * sin_u * sin_u * sin_u, axis_distance - E2 * A_M * cos_u * cos_u * cos_u);
    Geodetic { latitude_deg: latitude * 180.0 / PI, longitude_deg: libm::atan2(y, x) * 180.0 / PI }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_point_of_the_plane_is_found_again_from_its_place_on_the_earth(
            latitude_deg in -80.0..80.0, longitude_deg in -180.0..180.0, x in -5e3..5e3, y in -5e3..5e3,
        ) {
            let plane = LocalPlane::new(Geodetic { latitude_deg, longitude_deg });
            let (east, north) = plane.local(plane.geodetic(x, y));
            // The place is on the ellipsoid, 4 m below the plane at 7 km: that leans it by 5 mm.
            prop_assert!((east - x).abs() < 0.01 && (north - y).abs() < 0.01, "{east} {north}");
        }
    }
}
