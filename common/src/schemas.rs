//! JSON schemas (draft 2020-12) of what may stand in a payload of encoding `application/json`, for other
//! languages' tools. Fields and required fields are those of [`crate::wire::json`]: a test holds them together.

/// Of a detection frame.
pub const DETECTION_FRAME: &str = include_str!("../schemas/detection-frame.schema.json");
/// Of a sensor description.
pub const SENSOR_DESCRIPTION: &str = include_str!("../schemas/sensor-description.schema.json");
/// Of a fused frame.
pub const FUSED_FRAME: &str = include_str!("../schemas/fused-frame.schema.json");
