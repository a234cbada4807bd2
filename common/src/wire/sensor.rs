//! Sensor descriptions as bytes. Sent once a second: plain f64, nothing quantised.

use super::error::{VERSION, WireError};
use super::framing::{Kind, finish, put, take, take_preamble};
use crate::class::Class;
use crate::sensor::{Accuracy, Body, FieldOfView, SensorDescription, SensorKind, SizeNoiseLaw};
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
struct WireSensor {
    revision: u32,
    kind: u8,
    field_of_view: [f64; 4],
    detection_probability: f64,
    clutter_per_m2: f64,
    size_noise: Option<(f64, f64)>,
    body: Option<(u8, f64, f64)>,
    accuracy: [f64; 3],
    rate_hz: f64,
}

const VEHICLE: u8 = 0;
const ROADSIDE_UNIT: u8 = 1;

/// Appends the description to the buffer, in version [`VERSION`].
pub fn encode(description: &SensorDescription, buffer: &mut Vec<u8>) -> Result<(), WireError> {
    description.validate()?;
    let fov = &description.field_of_view;
    let accuracy = &description.accuracy;
    buffer.extend([VERSION, Kind::Sensor as u8]);
    let wire = WireSensor {
        revision: description.revision,
        kind: match description.kind {
            SensorKind::Vehicle => VEHICLE,
            SensorKind::RoadsideUnit => ROADSIDE_UNIT,
        },
        field_of_view: [fov.range_min_m, fov.range_max_m, fov.azimuth_rad, fov.width_rad],
        detection_probability: description.detection_probability,
        clutter_per_m2: description.clutter_per_m2,
        size_noise: description.size_noise.map(|law| (law.sigma, law.lower)),
        body: description.body.map(|body| (body.class.byte(), body.w, body.d)),
        accuracy: [accuracy.position_m, accuracy.yaw_rad, accuracy.clock_s],
        rate_hz: description.rate_hz,
    };
    put(&wire, buffer)
}

/// The description of the bytes, validated.
pub fn decode(bytes: &[u8]) -> Result<SensorDescription, WireError> {
    let mut bytes = bytes;
    take_preamble(&mut bytes, Kind::Sensor)?;
    let wire: WireSensor = take(&mut bytes)?;
    finish(bytes)?;
    let [range_min_m, range_max_m, azimuth_rad, width_rad] = wire.field_of_view;
    let [position_m, yaw_rad, clock_s] = wire.accuracy;
    let body = match wire.body {
        Some((byte, w, d)) => {
            Some(Body { class: Class::from_byte(byte).ok_or(WireError::UnknownClass(byte))?, w, d })
        }
        None => None,
    };
    let description = SensorDescription {
        revision: wire.revision,
        kind: match wire.kind {
            VEHICLE => SensorKind::Vehicle,
            ROADSIDE_UNIT => SensorKind::RoadsideUnit,
            other => return Err(WireError::UnknownFlags(other)),
        },
        field_of_view: FieldOfView { range_min_m, range_max_m, azimuth_rad, width_rad },
        detection_probability: wire.detection_probability,
        clutter_per_m2: wire.clutter_per_m2,
        size_noise: wire.size_noise.map(|(sigma, lower)| SizeNoiseLaw { sigma, lower }),
        body,
        accuracy: Accuracy { position_m, yaw_rad, clock_s },
        rate_hz: wire.rate_hz,
    };
    description.validate()?;
    Ok(description)
}
