//! What it costs that a detection and a track are of different classes.
//!
//! Detectors confuse classes within a group (a van is a car or a truck), and a cyclist with the person on the bicycle. A
//! lorry is no person: between other groups there is no pair.

use v2x_common::class::{Class, ClassGroup};

/// Within a group: -2 ln of one confusion in twenty, about.
const WITHIN_GROUP: f64 = 6.0;
/// A person and a vehicle on two wheels.
const RIDER: f64 = 10.0;

/// The cost of a pair of classes, in units of -2 ln p; `None` where it is impossible.
#[inline]
pub(super) fn class_cost(a: Class, b: Class) -> Option<f64> {
    if a.is_compatible_with(b) {
        return Some(0.0);
    }
    match (a.group(), b.group()) {
        (a, b) if a == b => Some(WITHIN_GROUP),
        (ClassGroup::Pedestrian, ClassGroup::TwoWheeled)
        | (ClassGroup::TwoWheeled, ClassGroup::Pedestrian) => Some(RIDER),
        _ => None,
    }
}

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(super) fn listed() -> Vec<(&'static str, String)> {
    vec![("association.class_cost", format!("{WITHIN_GROUP} within a group, {RIDER} of a rider"))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_that_are_confused_cost_and_others_make_no_pair() {
        assert_eq!(class_cost(Class::Car, Class::Car), Some(0.0));
        assert_eq!(class_cost(Class::Unknown, Class::Adult), Some(0.0));
        assert_eq!(class_cost(Class::Car, Class::Truck), Some(WITHIN_GROUP));
        assert_eq!(class_cost(Class::Bicycle, Class::Adult), Some(RIDER));
        assert_eq!(class_cost(Class::Car, Class::Adult), None);
        assert_eq!(class_cost(Class::Barrier, Class::Truck), None);
    }
}
