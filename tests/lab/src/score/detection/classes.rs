//! nuScenes' ten classes for detection.

use serde::{Deserialize, Serialize};
use v2x_common::class::Class;

/// The classes of nuScenes' detection evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DetectionClass {
    /// Cars.
    Car,
    /// Trucks.
    Truck,
    /// Buses, bendy and rigid.
    Bus,
    /// Trailers.
    Trailer,
    /// Construction vehicles.
    ConstructionVehicle,
    /// Pedestrians.
    Pedestrian,
    /// Motorcycles.
    Motorcycle,
    /// Bicycles.
    Bicycle,
    /// Traffic cones: without heading and velocity.
    TrafficCone,
    /// Barriers: without velocity, and equal after half a turn.
    Barrier,
}

impl DetectionClass {
    /// All classes.
    pub const ALL: [Self; 10] = [
        Self::Car,
        Self::Truck,
        Self::Bus,
        Self::Trailer,
        Self::ConstructionVehicle,
        Self::Pedestrian,
        Self::Motorcycle,
        Self::Bicycle,
        Self::TrafficCone,
        Self::Barrier,
    ];

    /// `None` for categories that nuScenes does not evaluate detection on (`category_to_detection_name`).
    pub const fn of(class: Class) -> Option<Self> {
        Some(match class {
            Class::Car => Self::Car,
            Class::Truck => Self::Truck,
            Class::BendyBus | Class::RigidBus => Self::Bus,
            Class::Trailer => Self::Trailer,
            Class::ConstructionVehicle => Self::ConstructionVehicle,
            Class::Adult | Class::Child | Class::ConstructionWorker | Class::PoliceOfficer => {
                Self::Pedestrian
            }
            Class::Motorcycle => Self::Motorcycle,
            Class::Bicycle => Self::Bicycle,
            Class::TrafficCone => Self::TrafficCone,
            Class::Barrier => Self::Barrier,
            _ => return None,
        })
    }

    /// After this turn a box is the same, rad.
    pub(super) const fn period_rad(self) -> f64 {
        match self {
            Self::Barrier => std::f64::consts::PI,
            _ => std::f64::consts::TAU,
        }
    }

    /// Which errors nuScenes counts: translation, scale, orientation, velocity.
    pub(super) const fn counts(self) -> [bool; 4] {
        match self {
            Self::TrafficCone => [true, true, false, false],
            Self::Barrier => [true, true, true, false],
            _ => [true; 4],
        }
    }
}
