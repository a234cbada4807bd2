//! `v2x watch`: a consumer of fused objects.

mod args;
mod browser;
mod lists;
mod run;
mod table;

pub(crate) use args::WatchArgs;
pub(crate) use run::run;
