//! The hub as a process: the shell around the engine.

mod access;
mod agent_statuses;
#[cfg(feature = "cli")]
mod args;
#[cfg(feature = "cli")]
mod command;
mod core;
mod delta_stream;
mod encoding;
mod error;
mod exposure;
mod fair_queue;
mod health;
mod intake;
mod journal;
mod network;
mod on_demand;
mod partial_lists;
mod recorder;
mod roster;
mod run;
mod settings;
mod status;
mod tile_lists;
mod tile_settings;
mod timing;
mod turns;
mod unnamed;

pub use crate::fusion::SettingsError;
#[cfg(feature = "cli")]
pub use args::{HubArgs, hub_table};
#[cfg(feature = "cli")]
pub use command::{run, run_with};
pub use core::{Core, Handled};
pub use encoding::encode_list;
pub use error::HubError;
pub use health::Verdict;
pub use run::{HubSetup, serve};
pub use settings::{AgentSettings, HubSettings};
pub use status::{AgentStatus, HubStatus, Quantiles, RecordingStatus, RegistrationStatus};
pub use tile_settings::TileSettings;
pub use unnamed::InvalidName;
