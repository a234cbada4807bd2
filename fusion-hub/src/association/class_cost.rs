//! What it costs that a detection and a track are of different classes.
//!
//! Detectors confuse classes within a group (a van is a car or a truck), and a cyclist with the person on the bicycle. A
//! lorry is no person: between other groups there is no pair.

use crate::values::ClassLaw;
use v2x_common::class::{Class, ClassGroup};

/// Whether an object of one class may be taken for one of the other.
#[inline]
pub(super) fn is_confusable(a: Class, b: Class) -> bool {
    a.is_compatible_with(b) || a.group() == b.group() || is_rider(a, b)
}

/// A person and a vehicle on two wheels.
fn is_rider(a: Class, b: Class) -> bool {
    let is = |person: Class, vehicle: Class| {
        person.group() == ClassGroup::Pedestrian && vehicle.group() == ClassGroup::TwoWheeled
    };
    is(a, b) || is(b, a)
}

/// The cost of a pair of classes by an agent whose classes err so, in units of -2 ln p. Classes of which one is never taken
/// for the other make no pair.
#[inline]
pub(super) fn class_cost(a: Class, b: Class, law: &ClassLaw) -> f64 {
    if a.is_compatible_with(b) {
        0.0
    } else if a.group() == b.group() {
        law.cost_within_group()
    } else {
        law.cost_of_other()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_that_are_confused_cost_and_others_make_no_pair() {
        let cost = |a, b| is_confusable(a, b).then(|| class_cost(a, b, &ClassLaw::UNKNOWN));
        assert_eq!(cost(Class::Car, Class::Car), Some(0.0));
        assert_eq!(cost(Class::Unknown, Class::Adult), Some(0.0));
        assert!((cost(Class::Car, Class::Truck).unwrap() - 5.9).abs() < 0.1);
        assert!((cost(Class::Bicycle, Class::Adult).unwrap() - 9.9).abs() < 0.1);
        assert_eq!(cost(Class::Car, Class::Adult), None);
        assert_eq!(cost(Class::Barrier, Class::Truck), None);
    }

    #[test]
    fn a_class_of_an_agent_that_confuses_classes_costs_less() {
        let poor = ClassLaw { right: 0.6, within_group: 0.38 };
        let cost = |law: &ClassLaw| class_cost(Class::Truck, Class::Car, law);
        assert!(cost(&poor) < 1.0 && cost(&poor) < cost(&ClassLaw::UNKNOWN));
    }
}
