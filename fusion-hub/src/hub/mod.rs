//! The hub as a process: the shell around the engine.

mod args;
mod intake;
mod network;
mod roster;
mod run;
mod status;
mod timing;

pub use args::{HubArgs, hub_table};
pub use run::{run, run_with};
pub use status::{AgentStatus, HubStatus, Quantiles, RegistrationStatus};
