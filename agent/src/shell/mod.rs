//! The agent as a process: publishes what the simulated sensor sees, when the simulated link delivers it.

mod args;
mod publisher;
mod run;

pub use args::{AgentArgs, WireFormat};
pub use run::run;
