//! Fused frames as bytes.

mod decode;
mod encode;
mod head;
mod limits;

/// What is known of the heading stands above the number of classes, which takes this many bits.
const HEADING_SHIFT: u32 = 6;
/// Above the heading: whether a conflict about the class follows the classes.
const CONFLICT_SHIFT: u32 = 8;

pub use decode::decode;
pub(super) use decode::read_objects;
pub use encode::encode;
pub(super) use encode::write_objects;
pub(super) use head::{ListHead, MAX_HEAD_LEN, origin_m};
pub use limits::{MAX_AGENTS, MAX_INCLUDES, MAX_OBJECTS};
