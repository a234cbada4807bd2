//! `v2x replay`: puts the frames of a recording on a network again, as if their agents were there.

mod args;
mod run;
mod shift;

pub(crate) use args::ReplayArgs;
pub(crate) use run::run;
