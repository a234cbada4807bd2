//! What crosses a process boundary in a cooperative-perception network, and nothing else:
//! time, geometry, ids, sensor description, detection frame, fused frame, their wire codec and JSON
//! twin, recordings, key expressions, and (feature `net`) how to open a Zenoh session.
//!
//! Conventions: one map frame in metres (x east, y north), radians counter-clockwise, seconds, f64
//! and SI in memory everywhere.

pub mod class;
pub mod clock;
pub mod covariance;
pub mod detection;
pub mod fused;
pub mod geometry;
pub mod id;
pub mod keys;
#[cfg(feature = "net")]
pub mod net;
pub mod recording;
pub mod schemas;
pub mod sensor;
pub mod time;
pub mod wire;
