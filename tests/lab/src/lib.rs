//! The laboratory of a cooperative-perception network: it runs whole networks in a test, drives the hub's engine in
//! virtual time, scores it, and reports.
//!
//! For the tests of another project the feature `loopback` is enough (`default-features = false`). A camera that is
//! 300 ms late, and a test of what consumers get:
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
//!         // The frames are late. The fused object is at the car's present position all the same.
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
//! The feature `lab` adds the laboratory itself, in layers from low to high:
//!
//! - `data`: readers of data sets, tables and recordings; generators of scenes and detections.
//! - `drive`: one [`Driver`] feeds an engine with arrivals and asks it at publishing instants, in virtual time.
//! - `score`: match → errors → aggregate, and the [`tracking`] metrics of the field.
//! - `report`: text, Markdown, HTML, LaTeX, CSV and figures.
//! - [`commands`]: the command lines of `lab`. Each chooses a source, a method, a matching rule and a report.
//!
//! The feature `protocol` alone has what is pure of it: [`protocol`], the paper's detections with noise and its scores, for methods
//! in other languages.
//!
//! A method of one's own joins the tables as a [`Contender`] (`examples/own_method.rs`).

#![cfg_attr(
    all(feature = "protocol", not(feature = "lab")),
    expect(
        dead_code,
        unreachable_pub,
        unused_imports,
        reason = "what only the commands of the laboratory call"
    )
)]

#[cfg(feature = "lab")]
pub mod commands;
#[cfg(feature = "protocol")]
mod data;
#[cfg(feature = "protocol")]
mod drive;
#[cfg(feature = "loopback")]
pub mod loopback;
#[cfg(feature = "protocol")]
pub mod protocol;
#[cfg(feature = "lab")]
mod report;
#[cfg(feature = "protocol")]
mod score;

#[cfg(feature = "lab")]
pub use crate::{
    data::dataset::{DatasetError, Source, synthetic},
    data::run_log::RunLog,
    data::scene::{Keyframe, Scene, TrueBox},
    data::workload,
    drive::driver::{Consumer, Driver, Publishing},
    drive::keyframes::contender::Contender,
    drive::virtual_run::VirtualRun,
    report::plot::recorded::recorded_svg,
    score::detection,
    score::errors::BoxError,
    score::run::summary::Summary,
    score::tracking,
};
