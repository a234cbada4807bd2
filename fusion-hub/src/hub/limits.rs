//! How much a hub takes in.

/// Largest payload that is read: 4096 detections as verbose JSON.
pub(super) const MAX_BYTES: usize = 4 << 20;
/// Most frames of one agent that wait: six seconds at 10 Hz.
pub(super) const MAX_WAITING: usize = 64;
