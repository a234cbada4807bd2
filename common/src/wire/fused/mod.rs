//! Fused frames as bytes.

mod decode;
mod encode;
mod limits;

pub use decode::decode;
pub use encode::encode;
pub use limits::{MAX_AGENTS, MAX_INCLUDES, MAX_OBJECTS};
