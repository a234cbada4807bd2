//! The agent as a process: publishes the frames of the simulated sensor when the simulated link delivers them.

mod args;
mod hearing;
mod live_world;
mod publisher;
mod run;

pub use args::{AgentArgs, WireFormat};
pub use live_world::{LiveWorld, Steps};
pub use run::run;
