//! What a scenario file can say. Defaults are in `validate`, where the values get their meaning.

mod agent;
mod document;
mod link;
mod noise;
mod sending;
mod trace;

pub(super) use agent::{TomlAccuracy, TomlAgent, TomlClock, TomlFieldOfView, TomlPose, TomlPoseError};
pub(super) use document::{TomlOrigin, TomlRoad, TomlRoadKind, TomlScenario, TomlWorld, WorldKind};
pub(super) use link::TomlLink;
pub(super) use noise::{TomlNoise, TomlNoiseNumbers};
pub(super) use sending::{TomlPhase, TomlSend, TomlSensing, TomlTransmit};
