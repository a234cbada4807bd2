//! Frames that arrive after newer ones.

use serde::{Deserialize, Serialize};

/// What becomes of frames that arrive after newer ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LateFrames {
    /// They are fused at their own capture time.
    #[default]
    Fuse,
    /// They are refused if they were captured before an admitted frame by more than ε_s.
    Drop,
    /// Every frame is taken as captured when it arrives, as where delays are not considered. There is no Δmax then.
    IgnoreDelay,
}
