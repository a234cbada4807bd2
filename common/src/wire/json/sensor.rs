//! Sensor descriptions as JSON: the type itself, field by field.

use super::values::{parse, print};
use crate::sensor::SensorDescription;
use crate::wire::error::WireError;

/// The description of a JSON text, validated.
pub fn decode_sensor(bytes: &[u8]) -> Result<SensorDescription, WireError> {
    let description: SensorDescription = parse(bytes)?;
    description.validate()?;
    Ok(description)
}

/// The description as JSON.
pub fn encode_sensor(description: &SensorDescription) -> Result<Vec<u8>, WireError> {
    description.validate()?;
    print(description)
}
