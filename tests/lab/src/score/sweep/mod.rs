//! The score of one run of a sweep, to be stored and averaged.

pub(crate) mod provenance;
pub(crate) mod record;
pub(crate) mod scorer;
pub(crate) mod snapshots;
pub(crate) mod transit;
