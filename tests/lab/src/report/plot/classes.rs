//! How classes are shown: a tint for each group of classes that detectors confuse, and a short word for each class.

use crate::report::palette::{Colour, TINTS};
use v2x_common::class::{Class, ClassGroup};

/// The groups, in the order of a legend.
pub(super) const GROUPS: [ClassGroup; 5] = [
    ClassGroup::FourWheeled,
    ClassGroup::TwoWheeled,
    ClassGroup::Pedestrian,
    ClassGroup::Immobile,
    ClassGroup::Unknown,
];

/// The light colour of a group's boxes.
pub(super) const fn tint(group: ClassGroup) -> Colour {
    match group {
        ClassGroup::FourWheeled => TINTS[0],
        ClassGroup::TwoWheeled => TINTS[1],
        ClassGroup::Pedestrian => TINTS[2],
        ClassGroup::Immobile => TINTS[3],
        ClassGroup::Unknown => TINTS[4],
    }
}

/// A group in words.
pub(super) const fn group_name(group: ClassGroup) -> &'static str {
    match group {
        ClassGroup::FourWheeled => "car or larger vehicle",
        ClassGroup::TwoWheeled => "bicycle or motorcycle",
        ClassGroup::Pedestrian => "person or animal",
        ClassGroup::Immobile => "does not move by itself",
        ClassGroup::Unknown => "unknown class",
    }
}

/// A class in a short word, each class in another one.
pub(super) const fn word(class: Class) -> &'static str {
    match class {
        Class::Unknown => "?",
        Class::Animal => "animal",
        Class::Adult => "ped",
        Class::Child => "child",
        Class::ConstructionWorker => "worker",
        Class::PersonalMobility => "scooter",
        Class::PoliceOfficer => "officer",
        Class::Stroller => "stroller",
        Class::Wheelchair => "wheelchair",
        Class::Barrier => "barrier",
        Class::Debris => "debris",
        Class::PushablePullable => "cart",
        Class::TrafficCone => "cone",
        Class::BicycleRack => "rack",
        Class::Bicycle => "bike",
        Class::BendyBus => "bendy bus",
        Class::RigidBus => "bus",
        Class::Car => "car",
        Class::ConstructionVehicle => "digger",
        Class::Ambulance => "ambulance",
        Class::PoliceCar => "police",
        Class::Motorcycle => "moto",
        Class::Trailer => "trailer",
        Class::Truck => "truck",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_classes_have_one_word_and_no_two_groups_one_tint() {
        let words: BTreeSet<_> = Class::ALL.into_iter().map(word).collect();
        assert_eq!(words.len(), Class::ALL.len());
        let tints: BTreeSet<_> = GROUPS.into_iter().map(tint).collect();
        assert_eq!(tints.len(), GROUPS.len());
        assert!(
            Class::ALL.iter().all(|class| GROUPS.contains(&class.group())),
            "every group is in the legend"
        );
    }
}
