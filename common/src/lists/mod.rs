//! Lists that cost less than the whole one: what changes between key frames, and the tiles of an area; and the consumers'
//! side of both, which makes one list of them again.
//!
//! Objects of these lists name no contributors, and their frames no agents and no inclusions.

mod area;
mod delta;
mod follower;
mod source;
mod tolerance;

pub use area::AreaFollower;
pub use delta::{DeltaFrame, ListUpdate, extrapolated};
pub use follower::{DeltaFollower, FollowError, FrameNumber};
pub use source::DeltaSource;
pub use tolerance::Tolerance;
