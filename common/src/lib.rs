//! The data that agents, hubs and consumers of a cooperative-perception network exchange: time, geometry, names, sensor
//! descriptions, detection frames, fused frames; their binary encoding and its JSON twin; recordings; key expressions.
//! With the feature `net` also Zenoh sessions, logging and shutdown.
//!
//! Conventions: one map frame in metres (x east, y north), angles in radians counter-clockwise from x, SI units and `f64`
//! in memory. Times are integer nanoseconds since the Unix epoch.
//!
//! # Example
//!
//! A roadside unit reports one car. The binary payload rounds positions to 1 mm, and is what the hub subscribes to; the
//! JSON payload says the same for people and for other languages.
//!
//! ```
//! use v2x_common::wire::{detections, json};
//! use v2x_common::{
//!     AgentId, BevBox, BoxCovariance, Class, Covariance2, Detection, DetectionFrame, FrameId, HeadingKind, Pose,
//!     Timestamp,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let id = FrameId { agent: AgentId::new("rsu-north")?, epoch: 1, sequence: 42 };
//! let captured_at = Timestamp::from_micros(1_790_000_000_000_000).ok_or("beyond the year 2262")?;
//! let mut frame = DetectionFrame::empty(id, captured_at);
//! frame.sensor_pose = Some(Pose { x: 9.0, y: 11.0, yaw: 0.0 });
//! frame.detections.push(Detection {
//!     class: Class::Car,
//!     score: 1.0,
//!     bev: BevBox { x: 12.5, y: -3.25, w: 1.8, d: 4.5, yaw: 0.1 },
//!     covariance: BoxCovariance { position: Covariance2::isotropic(0.3), ww: 0.01, dd: 0.01, yaw: 0.003 },
//!     velocity: None,
//!     heading: HeadingKind::Known,
//!     source_track: None,
//! });
//! frame.validate()?;
//!
//! let mut payload = Vec::new();
//! detections::encode(&frame, &mut payload)?;
//! assert_eq!(detections::decode(&payload)?.detections[0].bev.x, 12.5);
//! let text = String::from_utf8(json::encode_detections(&frame)?)?;
//! assert!(text.contains("\"class\":\"vehicle.car\",\"x\":12.5"));
//! # Ok(())
//! # }
//! ```
//!
//! # Layers
//!
//! From low to high; a module imports from lower layers only:
//!
//! 1. [`time`], [`geometry`], [`covariance`], [`class`], [`id`], [`seed`], [`tile`]: plain values
//! 2. [`sensor`], [`detection`], [`fused`], [`lists`]: what agents and hubs publish
//! 3. [`wire`], [`keys`], [`recording`], [`schemas`]: how it is represented outside of a process
//! 4. [`clock`], `net`: the operating system and the network

pub mod class;
pub mod clock;
pub mod conventions;
pub mod covariance;
pub mod detection;
pub mod duration;
pub mod fused;
pub mod geometry;
pub mod heading;
pub mod id;
pub mod keys;
pub mod lists;
#[cfg(feature = "net")]
pub mod net;
pub mod recording;
pub mod reported;
pub mod schemas;
pub mod seed;
pub mod sensor;
pub mod shipped;
pub mod spelling;
pub mod tile;
pub mod time;
pub mod unmapped_names;
pub mod version;
pub mod wire;

pub use class::Class;
pub use covariance::{BoxCovariance, Covariance2, Velocity};
pub use detection::{Detection, DetectionFrame, HeadingKind, InvalidValue};
pub use fused::{FusedFrame, FusedObject};
pub use geometry::{BevBox, Pose};
pub use id::{AgentId, FrameId, TrackId};
pub use keys::Keys;
pub use sensor::SensorDescription;
pub use time::{Span, Timestamp};
pub use wire::WireError;
