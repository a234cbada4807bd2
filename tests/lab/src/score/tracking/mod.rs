//! Metrics of tracking and detection: what was there against what was reported, instant by instant.
//!
//! One data model, [`Sequence`], for all of them: [`clear`] (CLEAR MOT), [`identity`] (IDF1), [`hota`],
//! [`amota`] (nuScenes' tracking metrics), [`scale`] (nuScenes' ASE); [`nees`] asks whether covariances are
//! honest. Each gives the figures of the implementation that its field compares with, to 1e-6
//! (`tests/it/oracles`), and says how scenes combine.
//!
//! No metric but [`amota`] looks at classes: a car reported as a truck at the right place is a classification
//! error, not a miss and a false object. Restrict a sequence by [`Sequence::of_classes`] for figures by class.

pub mod amota;
mod chi2;
pub mod clear;
mod correspondence;
pub mod hota;
pub mod identity;
mod indexed;
pub mod nees;
pub mod scale;
pub mod sequence;

#[cfg(test)]
mod testing;

pub use sequence::{GATE_M, Instant, ReportedBox, Sequence, SequenceError};
