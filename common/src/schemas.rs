//! JSON schemas (draft 2020-12) of payloads with the encoding `application/json`, for tools of other languages. A test
//! compares their fields and required fields with those of [`crate::wire::json`].

/// Of a detection frame.
pub const DETECTION_FRAME: &str = include_str!("../schemas/detection-frame.schema.json");
/// Of a sensor description.
pub const SENSOR_DESCRIPTION: &str = include_str!("../schemas/sensor-description.schema.json");
/// Of a fused frame.
pub const FUSED_FRAME: &str = include_str!("../schemas/fused-frame.schema.json");
/// Of a delta frame.
pub const DELTA_FRAME: &str = include_str!("../schemas/delta-frame.schema.json");
