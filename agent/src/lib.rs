//! Simulated agents: vehicles and roadside units that detect the objects of a simulated world and send detection frames
//! over simulated links.
//!
//! All of it is pure: the same (scenario, seed, time) gives the same bits in every process and on every machine.
//! Transcendental functions are those of `libm`, random numbers come from [`random`]. Only `shell` (feature `net`) does
//! input and output: it publishes the frames of one agent over Zenoh.
//!
//! # Example
//!
//! A roadside unit at a crossing: from the text of a scenario to the world, the sensor, and one frame.
//!
//! ```
//! use std::sync::Arc;
//! use v2x_agent::{Boot, Scenario};
//! use v2x_common::Timestamp;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     name = "one-unit"
//!     [world]
//!     kind = "crossing"
//!     [[agents]]
//!     id = "rsu"
//!     kind = "roadside-unit"
//!     pose = { x = 9, y = 11 }
//!     noise = "N1"
//!     link = "its-g5"
//! "#;
//! let scenario = Scenario::from_toml(text)?;
//! let world = Arc::new(scenario.world(7));
//! let boot = Boot { seed: 7, epoch: 1, start: Timestamp::EPOCH };
//! let sensor = scenario.agents[0].sensor(world, boot)?;
//!
//! let observation = sensor.observe(20);
//! assert_eq!(observation.frame.captured_at, sensor.capture_time(20));
//! assert_eq!(observation.frame.detections.len(), observation.identities.objects.len());
//! # Ok(())
//! # }
//! ```
//!
//! # Layers
//!
//! From low to high; a module imports from lower layers only:
//!
//! 1. [`truth`], [`nuscenes`], [`clock`]: true objects; scenes of a data set; errors of a clock
//! 2. [`random`], [`trajectories`]: keyed random numbers; recorded traffic
//! 3. [`timing`], [`noise`], [`detector`], [`pose_error`]: rates and phases; errors of measurements, of detectors, of poses
//! 4. [`link`], [`world`]: delays and losses; ground truth as a function of parameters, seed and time
//! 5. [`sensor`]: detection frames
//! 6. [`sending`]: which detections are sent, when, and when they arrive
//! 7. [`scenario`]: the file that configures all of these
//! 8. `shell`: the agent as a process

pub mod clock;
pub mod detector;
pub mod link;
pub mod noise;
pub mod nuscenes;
pub mod pose_error;
pub mod random;
pub mod scenario;
pub mod sending;
pub mod sensor;
#[cfg(feature = "net")]
pub mod shell;
pub mod timing;
pub mod trajectories;
pub mod truth;
pub mod world;

pub use link::{Delay, Link, LinkConfig};
pub use noise::{NoiseLevel, NoiseModel};
pub use scenario::{AgentConfig, Scenario, ScenarioError};
pub use sending::{Fate, Sender};
pub use sensor::{Boot, Observation, Sensor, SensorConfig};
pub use truth::{Identities, ObjectId, TrueObject};
pub use world::World;
