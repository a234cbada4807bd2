//! The most items that one fused frame can contain.

/// Most objects in one frame.
pub const MAX_OBJECTS: usize = 65_536;
/// Most agents in one frame.
pub const MAX_AGENTS: usize = 4096;
/// Most detection frames that one fused frame newly includes.
pub const MAX_INCLUDES: usize = 65_536;
