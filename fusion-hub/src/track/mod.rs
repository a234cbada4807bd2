//! One tracked object: its evidence in time order, and what follows from it.

mod contributors;
mod existence;
mod history;
mod snapshot;

pub use contributors::{Contributor, Contributors};
pub use existence::Existence;
pub use history::{FOLD_SLACK, LateData, Records, Track};
pub use snapshot::Snapshot;
