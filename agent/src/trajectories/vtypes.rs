//! SUMO's vehicle types: `<vType id vClass length width/>` of a demand or additional file.

use std::collections::BTreeMap;
use std::io::BufRead;

use v2x_common::class::Class;
use v2x_common::detection::{MAX_SIZE_M, MIN_SIZE_M};

use super::error::TrafficError;
use super::options::VehicleType;
use super::xml::{Element, Next, Xml};

/// The vehicle types of a file.
pub fn read_vehicle_types(input: impl BufRead) -> Result<BTreeMap<String, VehicleType>, TrafficError> {
    let mut xml = Xml::new(input);
    let mut types = BTreeMap::new();
    while let Next::Element(element) = xml.next()? {
        if element.name == "vType" {
            types.insert(element.text("id", "an id")?.to_owned(), vehicle_type(&element)?);
        }
    }
    if types.is_empty() {
        return Err(TrafficError::Empty(" <vType …/>".to_owned()));
    }
    Ok(types)
}

fn vehicle_type(element: &Element) -> Result<VehicleType, TrafficError> {
    let size = |name| {
        let size = |size: f64| (MIN_SIZE_M..=MAX_SIZE_M).contains(&size);
        element.attribute(name).map(|_| element.number(name, "0.001 to 65 m", size)).transpose()
    };
    let class = element.attribute("vClass").map(class_of_vehicle_class);
    Ok(VehicleType { class: class.flatten(), width_m: size("width")?, length_m: size("length")? })
}

/// The class of one of SUMO's abstract vehicle classes, where we have one (<https://sumo.dlr.de/docs/Simulation/VehiclePermissions.html>).
pub fn class_of_vehicle_class(name: &str) -> Option<Class> {
    Some(match name {
        "passenger" | "private" | "taxi" | "evehicle" | "hov" | "vip" | "authority" | "army" => Class::Car,
        "bus" | "coach" => Class::RigidBus,
        "delivery" | "truck" => Class::Truck,
        "trailer" => Class::Trailer,
        "emergency" => Class::Ambulance,
        "motorcycle" | "moped" => Class::Motorcycle,
        "bicycle" => Class::Bicycle,
        "scooter" => Class::PersonalMobility,
        "pedestrian" => Class::Adult,
        "wheelchair" => Class::Wheelchair,
        "tram" | "rail_urban" | "rail" | "rail_electric" | "rail_fast" | "subway" => Class::BendyBus,
        _ => return None,
    })
}
