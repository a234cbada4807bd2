//! Two bodies cannot be at one place.

use super::overlap::Footprint;
use serde::{Deserialize, Serialize};
use v2x_common::class::{Class, ClassGroup};
use v2x_common::geometry::BevBox;

/// Two boxes are of one body if they share more than this of the smaller one.
const MOST_SHARED: f64 = 0.3;
/// Their distance must be known to this share of the smaller width.
const LEAST_KNOWN: f64 = 0.35;

/// The body of a vehicle on four wheels, where it is known well enough to exclude others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    footprint: Footprint,
    /// Variance of the position along the worse axis, m².
    variance: f64,
    width_m: f64,
}

impl Body {
    /// Of an object of this class in a box, whose position has this variance (m²) along its worse axis; `None` of what
    /// excludes nothing: people stand close together, and boxes of cyclists overlap.
    pub fn of(class: Class, bev: &BevBox, variance: f64) -> Option<Self> {
        let width_m = bev.w.min(bev.d);
        let is_known = variance <= LEAST_KNOWN * LEAST_KNOWN * width_m * width_m;
        (class.group() == ClassGroup::FourWheeled && is_known).then(|| Self {
            footprint: Footprint::of(bev),
            variance,
            width_m,
        })
    }

    /// Whether two of these can only be the same body.
    pub fn is_same(&self, other: &Self) -> bool {
        let width_m = self.width_m.min(other.width_m);
        if self.variance + other.variance > LEAST_KNOWN * LEAST_KNOWN * width_m * width_m {
            return false;
        }
        let smaller = self.footprint.area().min(other.footprint.area());
        self.footprint.intersection_area(&other.footprint) > MOST_SHARED * smaller
    }

    /// The circle about it: centre and radius, m.
    pub const fn circle(&self) -> ([f64; 2], f64) {
        self.footprint.circle()
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![("exclusion", format!("{MOST_SHARED} of the smaller box, known to {LEAST_KNOWN} of the width"))]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn car(x: f64, y: f64, sigma_m: f64) -> Option<Body> {
        Body::of(Class::Car, &BevBox { x, y, w: 1.8, d: 4.5, yaw: 0.0 }, sigma_m * sigma_m)
    }

    #[test]
    fn two_accurate_boxes_at_one_place_are_one_body_and_neighbours_are_two() {
        let (own, near) = (car(0.0, 0.0, 0.2).unwrap(), car(0.4, 0.3, 0.2).unwrap());
        assert!(own.is_same(&near));
        assert!(!own.is_same(&car(0.0, 1.9, 0.2).unwrap()), "side by side");
        assert!(!own.is_same(&car(4.4, 0.0, 0.2).unwrap()), "one behind the other");
    }

    #[test]
    fn what_is_not_known_well_enough_and_what_may_overlap_excludes_nothing() {
        assert!(car(0.0, 0.0, 0.7).is_none());
        assert!(!car(0.0, 0.0, 0.5).unwrap().is_same(&car(0.0, 0.0, 0.5).unwrap()));
        let person = BevBox { x: 0.0, y: 0.0, w: 0.6, d: 0.6, yaw: 0.0 };
        assert!(Body::of(Class::Adult, &person, 1e-4).is_none());
    }
}
