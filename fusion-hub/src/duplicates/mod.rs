//! Two tracks of one object: found by what frames hold of them.
//!
//! [`Duplicates`] reads every assignment for tracks that compete for a detection, and [`SequentialTest`] sums up over
//! frames and agents whether the two are one object. The tracker then merges them.

mod observer;
mod sequential_test;

pub(crate) use observer::Duplicates;

#[cfg(test)]
pub(crate) use sequential_test::listed;
