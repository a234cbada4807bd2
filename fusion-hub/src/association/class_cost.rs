//! What it costs that a detection and a track are of different classes.
//!
//! Detectors confuse classes within a group (a van is a car or a truck), and a cyclist with the person on the bicycle. Between
//! other groups confusions are rare, and then what is confused has the size of what it is taken for: a person at a car's door
//! makes no pair with the car.

use crate::values::{ClassLaw, Measurement, PredictedMeasurement};
use v2x_common::class::{Class, ClassGroup};

/// Between groups that are seldom confused: the largest squared distance of sizes of a pair (χ² with 2 degrees of freedom), and the
/// least share of the larger area.
const MOST_SIZE_DISTANCE2: f64 = 9.0;
const LEAST_AREA: f64 = 0.4;
/// What such a confusion costs beside that with a person and a vehicle on two wheels: three of ten are of this kind.
const SELDOM_COST: f64 = 2.4;

/// Whether a detection may be of a track for all that is said of classes and sizes.
#[inline]
pub(super) fn may_be_of(z: &Measurement, track: &PredictedMeasurement) -> bool {
    is_confusable(z.class, track.class) || has_size_of(z, track)
}

/// Whether an object of one class is often taken for one of the other.
#[inline]
pub(crate) fn is_confusable(a: Class, b: Class) -> bool {
    a.is_compatible_with(b) || a.group() == b.group() || is_rider(a, b)
}

#[cold]
fn has_size_of(z: &Measurement, track: &PredictedMeasurement) -> bool {
    let area = |[w, d]: [f64; 2]| w * d;
    let (own, other) = (area(z.size), area(track.size));
    own.min(other) >= LEAST_AREA * own.max(other)
        && z.size_distance2(track.size, track.size_variance) <= MOST_SIZE_DISTANCE2
}

/// A person and a vehicle on two wheels.
fn is_rider(a: Class, b: Class) -> bool {
    let is = |person: Class, vehicle: Class| {
        person.group() == ClassGroup::Pedestrian && vehicle.group() == ClassGroup::TwoWheeled
    };
    is(a, b) || is(b, a)
}

/// The cost of a pair of classes by an agent whose classes err so, in units of -2 ln p.
#[inline]
pub(super) fn class_cost(a: Class, b: Class, law: &ClassLaw) -> f64 {
    if a.is_compatible_with(b) {
        0.0
    } else if a.group() == b.group() {
        law.cost_within_group()
    } else if is_rider(a, b) {
        law.cost_of_other()
    } else {
        law.cost_of_other() + SELDOM_COST
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    vec![(
        "association.classes_seldom_confused",
        format!("{SELDOM_COST} more, sizes within {MOST_SIZE_DISTANCE2}, areas {LEAST_AREA}"),
    )]
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::covariance::Covariance2;
    use v2x_common::detection::HeadingKind;

    /// Whether a detection of this class and size may be of a track of this class and size.
    fn is_pair((a, size_a): (Class, [f64; 2]), (b, size_b): (Class, [f64; 2])) -> bool {
        let z = Measurement {
            class: a,
            position: [0.0; 2],
            r: Covariance2::isotropic(0.2),
            size: size_a,
            relative_variance: [0.01; 2],
            yaw: 0.0,
            yaw_variance: 0.01,
            size_law: [None; 2],
            heading: HeadingKind::Known,
            velocity: None,
            is_track: false,
            since_last_s: f64::INFINITY,
        };
        let track = PredictedMeasurement {
            class: b,
            position: [0.0; 2],
            position_covariance: Covariance2::isotropic(0.2),
            gate_covariance: Covariance2::isotropic(0.2),
            size: size_b,
            size_variance: [0.01; 2],
            yaw: 0.0,
            yaw_variance: 0.01,
            report_probability: 0.5,
            by_positions: None,
        };
        may_be_of(&z, &track)
    }

    fn cost(a: Class, b: Class) -> f64 {
        class_cost(a, b, &ClassLaw::UNKNOWN)
    }

    #[test]
    fn classes_cost_by_how_seldom_they_are_confused() {
        assert!(cost(Class::Car, Class::Car).abs() < 1e-12);
        assert!(cost(Class::Unknown, Class::Adult).abs() < 1e-12);
        assert!((cost(Class::Car, Class::Truck) - 5.9).abs() < 0.1);
        assert!((cost(Class::Bicycle, Class::Adult) - 9.9).abs() < 0.1);
        assert!((cost(Class::Car, Class::Motorcycle) - 12.3).abs() < 0.1, "one in 500, about");
        assert!((cost(Class::Barrier, Class::Truck) - 12.3).abs() < 0.1);
    }

    #[test]
    fn what_is_seldom_confused_makes_a_pair_only_where_sizes_agree() {
        let (car, person) = ([1.8, 4.5], [0.6, 0.6]);
        assert!(is_pair((Class::Car, car), (Class::Barrier, car)));
        assert!(is_pair((Class::Motorcycle, [1.0, 2.2]), (Class::Car, [1.1, 2.1])));
        assert!(!is_pair((Class::Adult, person), (Class::Car, car)), "at a car's door");
        assert!(!is_pair((Class::TrafficCone, [0.3, 0.3]), (Class::Adult, person)));
        assert!(is_pair((Class::Adult, person), (Class::Bicycle, [0.6, 1.8])), "often confused, of any size");
        assert!(is_pair((Class::Car, car), (Class::Truck, [2.5, 9.0])));
    }

    #[test]
    fn a_class_of_an_agent_that_confuses_classes_costs_less() {
        let poor = ClassLaw { right: 0.6, within_group: 0.38 };
        let cost = |law: &ClassLaw| class_cost(Class::Truck, Class::Car, law);
        assert!(cost(&poor) < 1.0 && cost(&poor) < cost(&ClassLaw::UNKNOWN));
        let poor = ClassLaw { right: 0.65, within_group: 0.05 };
        let cost = |law: &ClassLaw| class_cost(Class::Motorcycle, Class::Car, law);
        assert!(cost(&poor) < 5.0 && cost(&poor) < cost(&ClassLaw::UNKNOWN) - 7.0);
    }
}
