//! Ground truth as a pure function of (parameters, seed, time).
//!
//! A world is periodic with its loop length, unless it is a recording that ends. Its objects are boxes that stand, that go round a closed `path` by a
//! `profile` of speed, that follow recorded places, or that travel along an open path and are absent until the loop repeats: they appear and
//! disappear at the ends of the roads, out of sight of all agents.

mod body;
mod crossing;
mod error;
mod ground_truth;
mod highway;
mod motion;
mod parameters;
pub mod path;
pub mod profile;
mod recorded;
mod road;
mod roads;

pub use crossing::CrossingConfig;
pub use error::InvalidParameter;
pub use ground_truth::World;
pub use highway::HighwayConfig;
pub use parameters::{Route, Station, WorldAgent, WorldConfig, WorldParameters};
pub use recorded::{Course, RecordedWorld, traffic_roads};
pub use road::{Road, RoadKind};

#[cfg(test)]
mod tests;
