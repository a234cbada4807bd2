//! The wire: how frames become bytes.
//!
//! Version 1 is postcard behind a version byte and a kind byte. Positions are fixed-point (1 mm), headings 0.1 mrad,
//! standard deviations one byte each on a logarithmic scale that rounds up. Decoded frames are valid: every number is
//! finite and within its limits, and no bytes remain. [`json`] is the twin for people and for other languages.

pub mod delta;
pub mod detections;
mod error;
mod foreign;
mod framing;
pub mod fused;
pub mod journal;
pub mod json;
mod kinematic;
mod quantity;
pub mod sensor;
mod sigma;
pub mod stray;
mod varint;
mod writing;

use crate::lists::ListUpdate;
pub use error::{VERSION, WireError};
pub use foreign::Foreign;
pub use writing::{Writing, Writings};

/// The Zenoh encoding of a postcard payload.
pub const ENCODING_POSTCARD: &str = "application/vnd.v2x.postcard";
/// The Zenoh encoding of a JSON payload.
pub const ENCODING_JSON: &str = "application/json";

/// The key frame or delta frame of a sample.
pub fn decode_update(encoding: &str, bytes: &[u8]) -> Result<ListUpdate, WireError> {
    if is_json(encoding, bytes) { json::decode_update(bytes) } else { delta::decode_update(bytes) }
}

/// Whether a payload is JSON: by its Zenoh encoding; where that is none of ours, by its first character.
pub fn is_json(encoding: &str, bytes: &[u8]) -> bool {
    match encoding {
        ENCODING_JSON | "text/json" => true,
        ENCODING_POSTCARD => false,
        _ => bytes.trim_ascii_start().first() == Some(&b'{'),
    }
}
