//! Simulated agents: ego vehicles and roadside units.

pub mod clock;
pub mod link;
pub mod noise;
pub mod pose_error;
pub mod random;
pub mod scenario;
pub mod sending;
pub mod sensor;
#[cfg(feature = "net")]
pub mod shell;
pub mod timing;
pub mod truth;
pub mod world;

pub use link::{Delay, Link, LinkConfig, Outbox};
pub use noise::{NoiseLevel, NoiseModel};
pub use pose_error::PoseError;
pub use scenario::{AgentConfig, Scenario, ScenarioError};
pub use sending::{Fate, Sender};
pub use sensor::{Boot, Observation, Sensor, SensorConfig};
pub use truth::{Identities, ObjectId, TrueObject};
pub use world::{World, WorldParameters};
