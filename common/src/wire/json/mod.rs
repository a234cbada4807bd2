//! The JSON twin of the wire: for people, and for clients in other languages.
//!
//! Times are integer microseconds since the Unix epoch, 64-bit ids are strings, errors are standard
//! deviations. Of a detection frame only `captured_at` and each detection's `class`, `x` and `y` are
//! required; [`ReportDefaults`] fill the rest. Field names are checked: an unknown one is an error that
//! names it. The schemas are in `common/schemas/`.

mod delta;
mod detections;
mod fused;
mod partial;
mod sensor;
mod values;

pub use delta::{decode_delta, decode_update, encode_delta};
pub use detections::{DecodedDetections, decode_detections, decode_detections_as_sent};
pub use detections::{decode_detections_by, encode_detections};
pub use fused::{decode_fused, encode_fused};
pub use partial::{PartialDetection, PartialSigma, ReportDefaults};
pub use sensor::{decode_sensor, encode_sensor};
pub use values::decode_value;
