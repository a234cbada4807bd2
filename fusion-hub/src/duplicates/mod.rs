//! Two tracks of one object: found by what frames hold of them.
//!
//! [`Duplicates`] reads every assignment for tracks that compete for a detection, and [`SequentialTest`] sums up over
//! frames and agents whether the two are one object. The tracker then merges them.

mod exclusion;
mod observer;
mod sequential_test;

pub(crate) use exclusion::Exclusion;
pub(crate) use observer::Duplicates;

/// Every number, for [`crate::parameters`].
#[cfg(test)]
pub(crate) fn listed() -> Vec<(&'static str, String)> {
    [sequential_test::listed(), exclusion::listed()].concat()
}
