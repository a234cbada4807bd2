//! Detectors that err as real ones do: misses that last, headings that flip, classes that are confused, boxes that double,
//! clutter that stays, scores, and errors that are correlated over time.
//!
//! Every part is a random process over frame numbers that can be computed for any frame without those before it, as the
//! pose error. The caller keys the draws by seed, agent and object.

mod ghosts;
mod occlusion;
mod profile;
mod reports;

pub use occlusion::hidden;
pub use profile::{DetectorProfile, Profile};
pub use reports::{Detector, ObjectReport, Sighting};
