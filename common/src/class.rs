//! Object classes: the 23 nuScenes categories and `unknown`.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

macro_rules! classes {
    ($($variant:ident = $byte:literal, $name:literal, [$w:literal, $d:literal];)*) => {
        /// The class of an object: one byte on the wire, its nuScenes name in JSON.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Class {
            $(#[doc = concat!("`", $name, "`")] $variant = $byte,)*
        }

        impl Class {
            /// Every class, by its byte.
            pub const ALL: [Self; classes!(@count $($variant)*)] = [$(Self::$variant,)*];

            /// The name in JSON and in tables.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// A typical width and depth, m: round numbers from makers' data sheets and traffic
            /// standards, for reports without a size. Not estimated from any data set.
            pub const fn typical_size(self) -> (f64, f64) {
                match self { $(Self::$variant => ($w, $d),)* }
            }
        }
    };
    (@count $($x:ident)*) => { [$(classes!(@unit $x)),*].len() };
    (@unit $x:ident) => { () };
}

classes! {
    Unknown = 0, "unknown", [1.0, 1.0];
    Animal = 1, "animal", [0.4, 0.8];
    Adult = 2, "human.pedestrian.adult", [0.7, 0.7];
    Child = 3, "human.pedestrian.child", [0.5, 0.5];
    ConstructionWorker = 4, "human.pedestrian.construction_worker", [0.7, 0.7];
    PersonalMobility = 5, "human.pedestrian.personal_mobility", [0.6, 1.2];
    PoliceOfficer = 6, "human.pedestrian.police_officer", [0.7, 0.7];
    Stroller = 7, "human.pedestrian.stroller", [0.6, 1.0];
    Wheelchair = 8, "human.pedestrian.wheelchair", [0.7, 1.1];
    Barrier = 9, "movable_object.barrier", [2.0, 0.5];
    Debris = 10, "movable_object.debris", [0.6, 0.6];
    PushablePullable = 11, "movable_object.pushable_pullable", [0.6, 0.7];
    TrafficCone = 12, "movable_object.trafficcone", [0.4, 0.4];
    BicycleRack = 13, "static_object.bicycle_rack", [2.0, 4.0];
    Bicycle = 14, "vehicle.bicycle", [0.6, 1.8];
    BendyBus = 15, "vehicle.bus.bendy", [2.55, 18.0];
    RigidBus = 16, "vehicle.bus.rigid", [2.55, 12.0];
    Car = 17, "vehicle.car", [1.8, 4.5];
    ConstructionVehicle = 18, "vehicle.construction", [2.5, 6.5];
    Ambulance = 19, "vehicle.emergency.ambulance", [2.1, 6.0];
    PoliceCar = 20, "vehicle.emergency.police", [1.9, 4.8];
    Motorcycle = 21, "vehicle.motorcycle", [0.8, 2.1];
    Trailer = 22, "vehicle.trailer", [2.5, 12.0];
    Truck = 23, "vehicle.truck", [2.5, 7.5];
}

/// Classes that detectors confuse with each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum ClassGroup {
    /// Of no known class.
    #[default]
    Unknown,
    /// People on foot, and animals.
    Pedestrian,
    /// Bicycles and motorcycles.
    TwoWheeled,
    /// Cars and larger vehicles.
    FourWheeled,
    /// What does not move by itself.
    Immobile,
}

impl ClassGroup {
    /// Every group, in the order of their numbers.
    pub const ALL: [Self; 5] =
        [Self::Unknown, Self::Pedestrian, Self::TwoWheeled, Self::FourWheeled, Self::Immobile];

    /// The name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Pedestrian => "people",
            Self::TwoWheeled => "two-wheelers",
            Self::FourWheeled => "cars and larger",
            Self::Immobile => "things that stand",
        }
    }
}

/// Names that other data sets, simulators, messages and detectors use, in lower case with `_` for spaces and dashes: those
/// of Argoverse 2, Autoware, DAIR-V2X, KITTI, nuScenes and Waymo, of CARLA's `base_type` and semantic tags, and of the
/// station and object types of ETSI's CPM and of SAE's SDSM. What has no obvious counterpart is left out: `vru` can be a
/// person or a bicycle.
const FOREIGN_NAMES: &[(&str, Class)] = &[
    ("adult", Class::Adult),
    ("ambulance", Class::Ambulance),
    ("ananimal", Class::Animal),
    ("animal", Class::Animal),
    ("apedalcyclist", Class::Bicycle),
    ("apedestrian", Class::Adult),
    ("apublicsafetyworker", Class::PoliceOfficer),
    ("articulated_bus", Class::BendyBus),
    ("barrier", Class::Barrier),
    ("bendy_bus", Class::BendyBus),
    ("bicycle", Class::Bicycle),
    ("bicycle_rack", Class::BicycleRack),
    ("bicyclist", Class::Bicycle),
    ("bicyclist_and_light_vru_vehicle", Class::Bicycle),
    ("bicyclistandlightvruvehicle", Class::Bicycle),
    ("bike", Class::Bicycle),
    ("box_truck", Class::Truck),
    ("bus", Class::RigidBus),
    ("car", Class::Car),
    ("child", Class::Child),
    ("cone", Class::TrafficCone),
    ("construction_cone", Class::TrafficCone),
    ("construction_vehicle", Class::ConstructionVehicle),
    ("construction_worker", Class::ConstructionWorker),
    ("cyclist", Class::Bicycle),
    ("debris", Class::Debris),
    ("dog", Class::Animal),
    ("dontcare", Class::Unknown),
    ("emergency_vehicle", Class::Ambulance),
    ("first_responder", Class::PoliceOfficer),
    ("heavy_truck", Class::Truck),
    ("heavytruck", Class::Truck),
    ("human", Class::Adult),
    ("large_vehicle", Class::Truck),
    ("light_truck", Class::Truck),
    ("light_vru_vehicle", Class::PersonalMobility),
    ("lighttruck", Class::Truck),
    ("lightvruvehicle", Class::PersonalMobility),
    ("lorry", Class::Truck),
    ("minivan", Class::Car),
    ("misc", Class::Unknown),
    ("moped", Class::Motorcycle),
    ("motorbike", Class::Motorcycle),
    ("motorcycle", Class::Motorcycle),
    ("motorcyclist", Class::Motorcycle),
    ("ordinary_pedestrian", Class::Adult),
    ("other", Class::Unknown),
    ("passenger_car", Class::Car),
    ("passengercar", Class::Car),
    ("pedestrian", Class::Adult),
    ("pedestrians", Class::Adult),
    ("person", Class::Adult),
    ("person_sitting", Class::Adult),
    ("personal_mobility", Class::PersonalMobility),
    ("pickup", Class::Truck),
    ("pickup_truck", Class::Truck),
    ("police_car", Class::PoliceCar),
    ("police_officer", Class::PoliceOfficer),
    ("pushable_pullable", Class::PushablePullable),
    ("regular_vehicle", Class::Car),
    ("rigid_bus", Class::RigidBus),
    ("road_worker", Class::ConstructionWorker),
    ("roadworker", Class::ConstructionWorker),
    ("school_bus", Class::RigidBus),
    ("scooter", Class::Motorcycle),
    ("stroller", Class::Stroller),
    ("suv", Class::Car),
    ("taxi", Class::Car),
    ("traffic_cone", Class::TrafficCone),
    ("trafficcone", Class::TrafficCone),
    ("trailer", Class::Trailer),
    ("train", Class::BendyBus),
    ("tram", Class::BendyBus),
    ("tricyclist", Class::Motorcycle),
    ("truck", Class::Truck),
    ("truck_cab", Class::Truck),
    ("type_bicycle", Class::Bicycle),
    ("type_bus", Class::RigidBus),
    ("type_car", Class::Car),
    ("type_cyclist", Class::Bicycle),
    ("type_motorcycle", Class::Motorcycle),
    ("type_motorcyclist", Class::Motorcycle),
    ("type_pedestrian", Class::Adult),
    ("type_truck", Class::Truck),
    ("type_unknown", Class::Unknown),
    ("type_vehicle", Class::Car),
    ("van", Class::Car),
    ("vehicle", Class::Car),
    ("vehicles", Class::Car),
    ("vehicular_trailer", Class::Trailer),
    ("walker", Class::Adult),
    ("wheelchair", Class::Wheelchair),
    ("wheeled_device", Class::PersonalMobility),
];

/// Makers in the names of CARLA's vehicles (`vehicle.<maker>.<model>`), of which some make cars only.
const CARLA_MAKERS: &[&str] = &[
    "audi",
    "bmw",
    "chevrolet",
    "citroen",
    "dodge",
    "ford",
    "jeep",
    "lincoln",
    "mercedes",
    "mercedes_benz",
    "micro",
    "mini",
    "nissan",
    "seat",
    "tesla",
    "toyota",
    "volkswagen",
];

/// CARLA's vehicles that are no cars (<https://carla.readthedocs.io/en/latest/catalogue_vehicles/>), without `vehicle.`.
const CARLA_OTHERS: &[(&str, Class)] = &[
    ("bh.crossbike", Class::Bicycle),
    ("carlamotors.carlacola", Class::Truck),
    ("carlamotors.european_hgv", Class::Truck),
    ("carlamotors.firetruck", Class::Truck),
    ("diamondback.century", Class::Bicycle),
    ("ford.ambulance", Class::Ambulance),
    ("gazelle.omafiets", Class::Bicycle),
    ("harley_davidson.low_rider", Class::Motorcycle),
    ("kawasaki.ninja", Class::Motorcycle),
    ("mitsubishi.fusorosa", Class::RigidBus),
    ("vespa.zx125", Class::Motorcycle),
    ("yamaha.yzf", Class::Motorcycle),
];

/// The class of one of CARLA's blueprints, in lower case with `_`.
fn of_carla(folded: &str) -> Option<Class> {
    if folded.starts_with("walker.pedestrian.") {
        return Some(Class::Adult);
    }
    let model = folded.strip_prefix("vehicle.")?;
    let (maker, _) = model.split_once('.')?;
    let other = CARLA_OTHERS.iter().find(|(name, _)| model.starts_with(name)).map(|(_, class)| *class);
    other.or_else(|| {
        let is_police = model.ends_with("police") || model.contains("police_");
        let of_maker = if is_police { Class::PoliceCar } else { Class::Car };
        CARLA_MAKERS.contains(&maker).then_some(of_maker)
    })
}

impl Class {
    /// The class of a wire byte.
    pub fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.get(usize::from(byte)).copied()
    }

    /// The wire byte.
    #[inline]
    pub const fn byte(self) -> u8 {
        self as u8
    }

    /// The class of a name: ours, or one that other data sets use (`car`, `Pedestrian`, `traffic-cone`).
    pub fn from_name(name: &str) -> Option<Self> {
        if let Some(class) = Self::ALL.into_iter().find(|class| class.name() == name) {
            return Some(class);
        }
        let folded: String = name
            .trim()
            .chars()
            .map(|c| if c == ' ' || c == '-' { '_' } else { c.to_ascii_lowercase() })
            .collect();
        let foreign = FOREIGN_NAMES.iter().find(|(foreign, _)| *foreign == folded).map(|(_, class)| *class);
        foreign.or_else(|| of_carla(&folded))
    }

    /// Whether two detections can be of one object: equal classes, or one is unknown.
    #[inline]
    pub fn is_compatible_with(self, other: Self) -> bool {
        self == other || self == Self::Unknown || other == Self::Unknown
    }

    /// The group of classes that detectors confuse with each other.
    pub const fn group(self) -> ClassGroup {
        if matches!(self, Self::Unknown) {
            ClassGroup::Unknown
        } else if self.is_pedestrian() || matches!(self, Self::Animal) {
            ClassGroup::Pedestrian
        } else if self.is_two_wheeler() {
            ClassGroup::TwoWheeled
        } else if self.is_immobile() {
            ClassGroup::Immobile
        } else {
            ClassGroup::FourWheeled
        }
    }

    /// Whether it has a front that a detector can take for its back: vehicles, and what is not known. People turn round.
    pub const fn has_front(self) -> bool {
        matches!(self.group(), ClassGroup::FourWheeled | ClassGroup::TwoWheeled | ClassGroup::Unknown)
    }

    /// People on foot, and strollers and wheelchairs.
    #[inline]
    pub const fn is_pedestrian(self) -> bool {
        matches!(
            self,
            Self::Adult
                | Self::Child
                | Self::ConstructionWorker
                | Self::PersonalMobility
                | Self::PoliceOfficer
                | Self::Stroller
                | Self::Wheelchair
        )
    }

    /// Objects that do not move by themselves.
    #[inline]
    pub const fn is_immobile(self) -> bool {
        matches!(
            self,
            Self::Barrier | Self::Debris | Self::PushablePullable | Self::TrafficCone | Self::BicycleRack
        )
    }

    /// Vehicles on two wheels.
    #[inline]
    pub const fn is_two_wheeler(self) -> bool {
        matches!(self, Self::Bicycle | Self::Motorcycle)
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl Serialize for Class {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Class {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
        Self::from_name(&name).ok_or_else(|| serde::de::Error::custom(format_args!("unknown class {name:?}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_names_round_trip_for_all_24() {
        assert_eq!(Class::ALL.len(), 24);
        for (byte, class) in (0u8..).zip(Class::ALL) {
            assert_eq!(class.byte(), byte);
            assert_eq!(Class::from_byte(byte), Some(class));
            assert_eq!(Class::from_name(class.name()), Some(class));
        }
        assert_eq!(Class::from_byte(24), None);
    }

    #[test]
    fn foreign_names_are_mapped_and_others_are_not_guessed() {
        assert_eq!(Class::from_name("Car"), Some(Class::Car));
        assert_eq!(Class::from_name("Traffic-Cone"), Some(Class::TrafficCone));
        assert_eq!(Class::from_name("spaceship"), None);
        for name in ["vru", "3", "vehicle.spaceship", "vehicle.spaceship.x", "walker"] {
            assert_eq!(Class::from_name(name).is_some(), name == "walker", "{name}");
        }
        assert!(FOREIGN_NAMES.is_sorted_by_key(|(name, _)| *name));
    }

    #[test]
    fn names_of_simulators_messages_and_data_sets_are_mapped() {
        for (name, class) in [
            ("vehicle.tesla.model3", Class::Car),
            ("vehicle.mercedes-benz.coupe", Class::Car),
            ("vehicle.dodge.charger_police", Class::PoliceCar),
            ("vehicle.harley-davidson.low_rider", Class::Motorcycle),
            ("vehicle.mitsubishi.fusorosa", Class::RigidBus),
            ("walker.pedestrian.0012", Class::Adult),
            ("passengerCar", Class::Car),
            ("heavyTruck", Class::Truck),
            ("bicyclistAndLightVruVehicle", Class::Bicycle),
            ("aPEDALCYCLIST", Class::Bicycle),
            ("PEDESTRIAN", Class::Adult),
            ("Person_sitting", Class::Adult),
            ("TYPE_CYCLIST", Class::Bicycle),
            ("construction worker", Class::ConstructionWorker),
            ("REGULAR_VEHICLE", Class::Car),
        ] {
            assert_eq!(Class::from_name(name), Some(class), "{name}");
        }
    }
}
