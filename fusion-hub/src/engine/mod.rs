//! The engine: admission of frames, the agents, the horizon of history, correction of clocks and poses, and publishing
//! around a fusion method.

mod admission;
mod agents;
mod config;
mod description_bytes;
#[expect(clippy::module_inception, reason = "the engine of the layer of the engine")]
mod engine;
mod held_up;
mod history;
mod map_frames;
mod output;
mod processes;
mod refusal;
mod schedule;
mod sieve;
mod statistics;
#[cfg(test)]
mod tests;

pub use agents::{AgentRecord, AgentRegistry, MAX_AGENTS, MAX_FRAMES_WITHIN_DELTA_MAX};
pub use config::EngineConfig;
pub use engine::{Engine, HistoryError};
pub use history::{MAX_FRAMES, MAX_MEASUREMENTS, MAX_MEASUREMENTS_OF_AGENT};
pub use refusal::{Disposition, Refusal, StampFault};
pub use schedule::{PublishMode, Schedule};
pub use statistics::{AgentStatistics, DroppedDetections, Label};
