//! What every shell of the project needs of the network and the operating system.

pub mod logging;
pub mod queue;
pub mod session;
pub mod shutdown;
