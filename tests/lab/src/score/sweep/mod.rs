//! How one run of a sweep did, so that it can be kept and averaged.

pub mod provenance;
pub mod record;
pub mod scorer;
pub mod snapshots;
pub mod transit;
