//! `v2x scenario`: writes scenario files.

mod args;
mod init;
mod ride;
mod text;

pub(crate) use args::ScenarioArgs;
pub(crate) use init::run;
