//! The hub as a process: the shell around the engine.

#[cfg(feature = "cli")]
mod args;
#[cfg(feature = "cli")]
mod command;
mod intake;
mod network;
mod roster;
mod run;
mod status;
mod timing;

#[cfg(feature = "cli")]
pub use args::{HubArgs, hub_table};
#[cfg(feature = "cli")]
pub use command::{run, run_with};
pub use run::{HubSetup, serve};
pub use status::{AgentStatus, HubStatus, Quantiles, RegistrationStatus};
