//! One tracked object: its evidence in time order, and what follows from it.

mod contributors;
mod existence;
mod former;
mod history;
mod retrospect;
mod snapshot;

pub use contributors::{Contributor, Contributors};
pub use existence::{Existence, SURVIVAL_TIME_S};
pub use former::Former;
pub use history::{FOLD_SLACK, LateData, Records, Track};
pub use retrospect::{Retrospect, Retrospection};
pub use snapshot::Snapshot;

#[cfg(test)]
pub(crate) use existence::listed as existence_listed;
