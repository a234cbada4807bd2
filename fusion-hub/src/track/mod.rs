//! Tracks: the evidence of each object in the order of capture times, and the estimate that follows from it.

mod application;
mod checkpoints;
mod class_reports;
mod context;
mod contributors;
mod evidence;
mod frame_store;
mod orientation;
mod past;
mod pre_merge;
mod replay;
mod smoother;
mod snapshot;
mod together;
#[expect(clippy::module_inception, reason = "the track of the layer of tracks")]
mod track;

pub use class_reports::ClassReports;
pub use context::{FOLD_SLACK, Horizon, Rollback, TrackContext};
pub use contributors::{Contributor, Contributors};
pub use evidence::{Evidence, FrameSlot};
pub use frame_store::{FrameStore, SensedFrame, StoredFrame};
pub(crate) use orientation::Read;
pub(crate) use past::PastReader;
pub use pre_merge::PreMergeTracks;
pub(crate) use replay::Replayer;
pub use smoother::{FixedLagSmoother, SmoothedTrack};
pub use snapshot::Snapshot;
pub use track::Track;

#[cfg(test)]
pub(crate) use orientation::listed;
#[cfg(test)]
pub(crate) use snapshot::listed as snapshot_listed;
