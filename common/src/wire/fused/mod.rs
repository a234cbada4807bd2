//! Fused frames as bytes.

mod decode;
mod encode;

pub use decode::decode;
pub use encode::encode;

/// Most objects in one frame.
pub const MAX_OBJECTS: usize = 65_536;
/// Most agents in one frame.
pub const MAX_AGENTS: usize = 4096;
/// Most detection frames that one fused frame newly includes.
pub const MAX_INCLUDES: usize = 65_536;
