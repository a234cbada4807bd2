//! A whole network on this machine: real processes, a free port, and a clean end.

mod child;
mod launcher;

pub use child::{Child, ChildError};
pub use launcher::{AgentOptions, HubOptions, Launcher};
