//! `v2x sumo`: SUMO as the world of a network. It is the only client of TraCI; agents follow what it publishes.

mod args;
mod client;
mod error;
mod message;
mod objects;
mod program;
mod record;
mod run;

pub(crate) use args::SumoArgs;
pub(crate) use run::run;
