//! How one run of a sweep did, so that it can be kept and averaged.

pub(crate) mod provenance;
pub(crate) mod record;
pub(crate) mod scorer;
pub(crate) mod snapshots;
pub(crate) mod transit;
