//! Two bodies cannot be at one place.
//!
//! What is one body depends on what two boxes are of. Vehicles on four wheels share no ground, so that a share of the smaller
//! box is enough: a detector that splits a lorry reports a part within the whole. A box of a person within one of a bicycle is
//! of the rider. Any other two boxes have to agree in place and size, which their intersection over their union says: people
//! in a crowd and bicycles in a rack have boxes that overlap, and a person at a car's door is none of it.

use super::overlap::Footprint;
use serde::{Deserialize, Serialize};
use v2x_common::class::{Class, ClassGroup};
use v2x_common::covariance::Covariance2;
use v2x_common::geometry::BevBox;

/// The distance of two bodies must be known to this share of the smaller width; of two vehicles on four wheels to this one.
const LEAST_KNOWN: f64 = 0.4;
const VEHICLE_KNOWN: f64 = 0.35;
/// Known to this share, an overlap of any but two vehicles counts half: small boxes of neighbours overlap by errors alone.
const HALF_KNOWN: f64 = 0.45;
/// Of two vehicles on four wheels: from this part of the smaller box in common on they are one.
const VEHICLES: f64 = 0.3;
/// Of a person and a vehicle on two wheels, part of the smaller box.
const RIDER: f64 = 0.5;
/// Of any other two, part of the union.
const OTHERS: f64 = 0.22;

/// The body of an object, where it is known well enough to exclude others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    footprint: Footprint,
    /// Variance of the position along the worst direction, m².
    variance: f64,
    width_m: f64,
    class: Class,
}

impl Body {
    /// Of an object of this class in a box, whose position has this covariance (m²); `None` of what is not known well enough.
    pub fn of(class: Class, bev: &BevBox, position: &Covariance2) -> Option<Self> {
        let width_m = bev.w.min(bev.d);
        let variance = most_variance(position);
        let is_known = variance <= LEAST_KNOWN * LEAST_KNOWN * width_m * width_m;
        is_known.then(|| Self { footprint: Footprint::of(bev), variance, width_m, class })
    }

    /// How much it has in common with another one, where 1 is as much as two bodies can have; 0 where their distance is not known
    /// well enough.
    pub fn overlap(&self, other: &Self) -> f64 {
        let width_m = self.width_m.min(other.width_m);
        let vagueness = (self.variance + other.variance) / (width_m * width_m);
        let keeps_clear = self.keeps_clear_of(other);
        let known = if keeps_clear { VEHICLE_KNOWN } else { LEAST_KNOWN };
        if vagueness > known * known {
            return 0.0;
        }
        let shared = self.footprint.intersection_area(&other.footprint);
        if shared <= 0.0 {
            return 0.0;
        }
        let (own_area, other_area) = (self.footprint.area(), other.footprint.area());
        let smaller = own_area.min(other_area);
        let most = match (self.class.group(), other.class.group()) {
            (ClassGroup::FourWheeled, ClassGroup::FourWheeled) => VEHICLES * smaller,
            (ClassGroup::Pedestrian, ClassGroup::TwoWheeled)
            | (ClassGroup::TwoWheeled, ClassGroup::Pedestrian) => RIDER * smaller,
            _ => OTHERS * (own_area + other_area - shared),
        };
        let doubt = if keeps_clear { 0.0 } else { vagueness / (HALF_KNOWN * HALF_KNOWN) };
        shared / (most * (1.0 + doubt))
    }

    /// Whether it and another one are both of vehicles on four wheels, which are never so near each other as people are who
    /// pass.
    pub fn keeps_clear_of(&self, other: &Self) -> bool {
        [self, other].iter().all(|body| body.class.group() == ClassGroup::FourWheeled)
    }

    /// The circle about it: centre and radius, m.
    pub const fn circle(&self) -> ([f64; 2], f64) {
        self.footprint.circle()
    }
}

/// The variance along the direction in which it is largest, m²: the same however the map is turned.
fn most_variance(position: &Covariance2) -> f64 {
    let Covariance2 { xx, xy, yy } = *position;
    let half = (xx - yy) / 2.0;
    (xx + yy) / 2.0 + (half * half + xy * xy).sqrt()
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![(
        "exclusion",
        format!(
            "vehicles {VEHICLES} of the smaller box, known to {VEHICLE_KNOWN} of the width, riders {RIDER} of it and others {OTHERS} of the union, known to {LEAST_KNOWN}, half at {HALF_KNOWN}"
        ),
    )]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(class: Class, [x, y]: [f64; 2], [w, d]: [f64; 2], sigma_m: f64) -> Option<Body> {
        Body::of(class, &BevBox { x, y, w, d, yaw: 0.0 }, &Covariance2::isotropic(sigma_m))
    }

    fn car(x: f64, y: f64, sigma_m: f64) -> Option<Body> {
        body(Class::Car, [x, y], [1.8, 4.5], sigma_m)
    }

    /// Whether two boxes of these classes and sizes can only be of one body, with so much between their centres.
    fn is_one(one: (Class, [f64; 2]), other: (Class, [f64; 2]), between: [f64; 2]) -> bool {
        let placed = |(class, size), at| body(class, at, size, 0.05).unwrap();
        let (one, other) = (placed(one, [0.0; 2]), placed(other, between));
        assert!((one.overlap(&other) - other.overlap(&one)).abs() < 1e-9);
        one.overlap(&other) >= 1.0
    }

    const PERSON: (Class, [f64; 2]) = (Class::Adult, [0.6, 0.6]);
    const BICYCLE: (Class, [f64; 2]) = (Class::Bicycle, [0.6, 1.8]);
    const MOTORCYCLE: (Class, [f64; 2]) = (Class::Motorcycle, [0.8, 2.0]);
    const CAR: (Class, [f64; 2]) = (Class::Car, [1.8, 4.5]);

    #[test]
    fn two_accurate_boxes_at_one_place_are_one_body_and_neighbours_are_two() {
        let (own, near) = (car(0.0, 0.0, 0.2).unwrap(), car(0.4, 0.3, 0.2).unwrap());
        assert!(own.overlap(&near) > 1.0);
        assert!(own.overlap(&car(0.0, 1.9, 0.2).unwrap()) < 0.1, "side by side");
        assert!(own.overlap(&car(4.4, 0.0, 0.2).unwrap()) < 0.1, "one behind the other");
    }

    #[test]
    fn boxes_of_any_class_that_agree_in_place_and_size_are_of_one_body() {
        assert!(is_one(MOTORCYCLE, MOTORCYCLE, [0.4, 0.0]));
        assert!(is_one(BICYCLE, BICYCLE, [0.4, 0.0]));
        assert!(is_one(PERSON, PERSON, [0.3, 0.0]));
        let unknown = (Class::Unknown, CAR.1);
        assert!(is_one(unknown, unknown, [0.3, 0.0]));
        assert!(is_one(CAR, unknown, [0.3, 0.0]));
        assert!(is_one(BICYCLE, PERSON, [0.2, 0.0]), "the rider");
        assert!(is_one((Class::Car, MOTORCYCLE.1), MOTORCYCLE, [0.2, 0.0]));
    }

    #[test]
    fn people_in_a_crowd_bicycles_in_a_rack_and_what_stands_at_a_vehicle_are_bodies_of_their_own() {
        assert!(!is_one(PERSON, PERSON, [0.7, 0.0]));
        assert!(!is_one(PERSON, PERSON, [0.45, 0.0]), "arm in arm");
        assert!(!is_one(BICYCLE, BICYCLE, [0.0, 0.45]), "in a rack");
        assert!(!is_one(MOTORCYCLE, MOTORCYCLE, [0.0, 0.8]));
        assert!(!is_one(BICYCLE, PERSON, [0.0, 0.45]), "pushed");
        assert!(!is_one(CAR, PERSON, [0.0, 0.7]), "in the door");
        assert!(!is_one(CAR, (Class::Unknown, PERSON.1), [0.0, 0.7]));
    }

    #[test]
    fn what_is_not_known_well_enough_excludes_nothing_however_the_map_is_turned() {
        assert!(car(0.0, 0.0, 0.75).is_none());
        let vague = car(0.0, 0.0, 0.5).unwrap();
        assert!(vague.overlap(&vague) < 0.1);
        assert!(body(PERSON.0, [0.0; 2], PERSON.1, 0.25).is_none());
        let overlap = |sigma_m| {
            let [one, other] = [0.0, 0.3].map(|x| body(PERSON.0, [x, 0.0], PERSON.1, sigma_m).unwrap());
            one.overlap(&other)
        };
        assert!(overlap(0.05) > 1.0 && overlap(0.15) < 1.0, "{} and {}", overlap(0.05), overlap(0.15));
        let far = Covariance2 { xx: 0.5, xy: 0.0, yy: 0.01 };
        let turned = Covariance2 { xx: 0.255, xy: 0.245, yy: 0.255 };
        assert!((most_variance(&far) - most_variance(&turned)).abs() < 1e-12);
    }
}
