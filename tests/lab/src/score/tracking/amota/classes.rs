//! nuScenes' seven classes for tracking.

use serde::{Deserialize, Serialize};
use v2x_common::class::Class;

/// The classes of nuScenes' tracking evaluation, in its order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrackingClass {
    /// Bicycles.
    Bicycle,
    /// Buses, bendy and rigid.
    Bus,
    /// Cars.
    Car,
    /// Motorcycles.
    Motorcycle,
    /// Pedestrians.
    Pedestrian,
    /// Trailers.
    Trailer,
    /// Trucks.
    Truck,
}

impl TrackingClass {
    /// All classes.
    pub const ALL: [Self; 7] =
        [Self::Bicycle, Self::Bus, Self::Car, Self::Motorcycle, Self::Pedestrian, Self::Trailer, Self::Truck];

    /// `None` for categories that nuScenes does not evaluate tracking on (`category_to_tracking_name`).
    pub const fn of(class: Class) -> Option<Self> {
        Some(match class {
            Class::Bicycle => Self::Bicycle,
            Class::BendyBus | Class::RigidBus => Self::Bus,
            Class::Car => Self::Car,
            Class::Motorcycle => Self::Motorcycle,
            Class::Adult | Class::Child | Class::ConstructionWorker | Class::PoliceOfficer => {
                Self::Pedestrian
            }
            Class::Trailer => Self::Trailer,
            Class::Truck => Self::Truck,
            _ => return None,
        })
    }
}
