//! The plane of the map frame on the earth: the tangent plane of WGS84 at the frame's origin.

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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Geodetic {
    /// Latitude, degrees north, -90 to 90.
    pub latitude_deg: f64,
    /// Longitude, degrees east, -180 to 180.
    pub longitude_deg: f64,
}

/// A map frame whose origin (0, 0) is a place on the ellipsoid, x east and y north in the tangent plane there.
#[derive(Clone, Copy, Debug, PartialEq)]
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
        // Radius of curvature in the prime vertical.
        let n_m = A_M / libm::sqrt(1.0 - E2 * sin_lat * sin_lat);
        Self {
            origin_m: [n_m * cos_lat * cos_lon, n_m * cos_lat * sin_lon, n_m * (1.0 - E2) * sin_lat],
            east: [-sin_lon, cos_lon, 0.0],
            north: [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
        }
    }

    /// The place of a point (m east, m north) of the plane. Its height above the ellipsoid, 8 m at a distance of 10 km, is
    /// left out.
    pub fn geodetic(&self, x_m: f64, y_m: f64) -> Geodetic {
        geodetic([0, 1, 2].map(|axis| self.origin_m[axis] + x_m * self.east[axis] + y_m * self.north[axis]))
    }
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
