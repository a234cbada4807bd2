//! `v2x world`: what is in a file of recorded traffic.

mod args;
mod run;
mod summary;

pub(crate) use args::WorldArgs;
pub(crate) use run::run;
