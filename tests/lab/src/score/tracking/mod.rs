//! Metrics of tracking and detection: true against reported boxes, instant by instant.
//!
//! All metrics have one data model, [`Sequence`]: [`clear`] (CLEAR MOT), [`identity`] (IDF1), [`hota`], [`amota`]
//! (nuScenes' tracking metrics), [`scale`] (nuScenes' ASE); [`nees`] tests the consistency of covariances. Each gives the
//! figures of the field's reference implementation, to 1e-6 (`tests/it/oracles`), and documents how scenes are combined.
//!
//! Only [`amota`] uses classes: a car reported as a truck at the right position is a classification error, not a miss and
//! a false object. Restrict a sequence by [`Sequence::of_classes`] for figures by class.

pub mod amota;
mod chi2;
pub mod clear;
mod correspondence;
pub mod figures;
pub mod hota;
pub mod identity;
mod indexed;
pub mod nees;
pub mod scale;
pub mod sequence;

#[cfg(test)]
pub(crate) mod testing;

pub use sequence::{GATE_M, Instant, ReportedBox, Sequence, SequenceError};
