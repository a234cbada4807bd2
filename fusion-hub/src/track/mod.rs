//! One tracked object: its evidence in time order, and what follows from it.

mod evidence;
mod existence;
mod history;
mod snapshot;

pub use evidence::{Evidence, EvidenceKey, Look, Sighting};
pub use existence::Existence;
pub use history::Track;
pub use snapshot::Snapshot;
