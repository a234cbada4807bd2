//! A whole network on this machine, for tests: a hub and agents on a free port, delay where it is asked for, fused
//! frames awaited, and a clean end.
//!
//! Two ways: [`Network`] runs the hub and scripted agents as tasks in the test's own process, so that another project
//! needs none of our programs. [`Launcher`] starts them as processes, by a program that has the subcommands `hub` and
//! `agent`; the tests of this project and `v2x demo` do so.
//!
//! In your `Cargo.toml`, without what reads data sets, draws, or has a command line:
//!
//! ```toml
//! [dev-dependencies]
//! v2x-lab = { git = "…", default-features = false, features = ["loopback"] }
//! ```
//!
//! The first page of this crate has an example.
//!
//! Time is real: a delay of 300 ms takes 300 ms. Whatever is random is drawn from the seed of an agent. Zenoh wants a
//! runtime of several threads: `#[tokio::test(flavor = "multi_thread")]`, or [`block_on`] where there is none.

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
// What frames are made of, so that a test needs to name one dependency alone.
pub use v2x_common;
pub use v2x_fusion_hub::hub::HubStatus;
