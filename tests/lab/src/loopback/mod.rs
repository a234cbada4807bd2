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
//! A camera that is 300 ms late, and a test of what consumers get:
//!
//! ```
//! use std::time::Duration;
//! use v2x_lab::loopback::v2x_common::fused::FusedFrame;
//! use v2x_lab::loopback::{Actor, KitError, Network, Script, block_on};
//!
//! fn main() -> Result<(), KitError> {
//!     block_on(async {
//!         let network = Network::start_with("delta_max_ms = 5000").await?;
//!         let camera = network.agent("camera").late_by(Duration::from_millis(300)).seed(7).join().await?;
//!         let car = Actor::car(10.0, 5.0).driving(8.0, 0.0);
//!         camera.play(Script::every(Duration::from_millis(100)).of([car]))?;
//!
//!         // The hub hears of it late, and tells where it is: not where it was.
//!         let start = network.started_at();
//!         let is_there = |frame: &FusedFrame| {
//!             let truth = car.bev_at(frame.fused_at - start);
//!             frame.objects.iter().any(|object| object.bev.pose().distance_to(truth.x, truth.y) < 1.0)
//!         };
//!         network.await_fused(is_there, Duration::from_secs(20)).await?;
//!         network.end().await.map(|_| ())
//!     })
//! }
//! ```
//!
//! Time is real: a delay of 300 ms takes 300 ms. Whatever is random is drawn from the seed of an agent. Zenoh wants a
//! runtime of several threads: `#[tokio::test(flavor = "multi_thread")]`, or [`block_on`] where there is none.

mod access;
mod agent;
mod child;
mod connection;
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
pub use error::{KitError, Seen};
pub use launcher::{AgentOptions, HubOptions, Launcher};
pub use network::Network;
pub use runtime::block_on;
pub use script::{Actor, Noise, Script};
// What frames are made of, so that a test needs to name one dependency alone.
pub use v2x_common;
pub use v2x_fusion_hub::hub::HubStatus;
