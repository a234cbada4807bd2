//! A network on this machine for tests: a hub and agents on a free port, links with delay, waiting for fused frames,
//! and a clean end.
//!
//! [`Network`] runs the hub and scripted agents as tasks in the process of the test, so that another project needs no
//! program of this one. [`Launcher`] starts them as processes of a program with the subcommands `hub` and `agent`, as
//! the tests of this project and `v2x demo` do.
//!
//! In your `Cargo.toml`, without data sets, plots and command lines:
//!
//! ```toml
//! [dev-dependencies]
//! v2x-lab = { git = "…", default-features = false, features = ["loopback"] }
//! ```
//!
//! The documentation of the crate starts with an example.
//!
//! Time is real: a delay of 300 ms takes 300 ms. All random values depend on the seed of an agent. Zenoh needs a
//! runtime of several threads: `#[tokio::test(flavor = "multi_thread")]`, or [`block_on`] without a runtime.

mod access;
mod agent;
mod child;
mod connection;
mod connection_error;
pub mod consumer;
mod delay_queue;
mod error;
pub mod hub_status;
mod launcher;
mod network;
mod runtime;
mod script;
mod task_group;

pub use agent::{Agent, NewAgent, Sent};
pub use child::{Child, ChildError};
pub use connection_error::ConnectionError;
pub use error::{KitError, Seen};
pub use launcher::{AgentOptions, HubOptions, Launcher};
pub use network::Network;
pub use runtime::block_on;
pub use script::{Actor, Noise, Script};
// The types of frames, so that a test needs only one dependency.
pub use v2x_common;
pub use v2x_fusion_hub::hub::HubStatus;
