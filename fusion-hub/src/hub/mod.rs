//! The hub as a process: the shell around the engine (feature `net`), and its core, which is pure (feature `core`).

#[cfg(feature = "net")]
mod access;
#[cfg(feature = "cli")]
mod again;
#[cfg(feature = "net")]
mod agent_statuses;
#[cfg(feature = "cli")]
mod args;
#[cfg(feature = "net")]
mod beats;
#[cfg(feature = "net")]
mod change_log;
#[cfg(feature = "cli")]
mod command;
#[cfg(feature = "net")]
mod control_counts;
#[cfg(feature = "net")]
mod control_queue;
mod core;
#[cfg(feature = "net")]
mod crowding;
#[cfg(feature = "net")]
mod delta_stream;
#[cfg(feature = "net")]
mod denials;
#[cfg(feature = "net")]
mod encoding;
#[cfg(feature = "net")]
mod error;
#[cfg(feature = "net")]
mod exposure;
#[cfg(feature = "net")]
mod fair_queue;
#[cfg(feature = "net")]
mod health;
#[cfg(feature = "net")]
mod intake;
#[cfg(feature = "net")]
mod journal;
mod limits;
#[cfg(feature = "net")]
mod monitor;
#[cfg(feature = "cli")]
mod monitoring;
#[cfg(feature = "net")]
mod network;
#[cfg(feature = "net")]
mod on_demand;
#[cfg(feature = "net")]
mod outbox;
#[cfg(feature = "net")]
mod partial_lists;
#[cfg(feature = "net")]
mod processor_time;
#[cfg(feature = "net")]
mod recorder;
#[cfg(feature = "net")]
mod roster;
#[cfg(feature = "net")]
mod run;
mod settings;
#[cfg(feature = "net")]
mod span_counts;
#[cfg(feature = "net")]
mod standby;
#[cfg(feature = "net")]
mod status;
#[cfg(feature = "net")]
mod strays;
#[cfg(feature = "net")]
mod system_clock;
#[cfg(feature = "net")]
mod tile_lists;
mod tile_settings;
#[cfg(feature = "net")]
mod timing;
#[cfg(feature = "net")]
mod token_changes;
#[cfg(feature = "net")]
mod turns;
#[cfg(feature = "net")]
mod twin;
#[cfg(feature = "net")]
mod unnamed;

pub use crate::fusion::SettingsError;
#[cfg(feature = "cli")]
pub use args::{HubArgs, hub_table, hub_table_if_any, settings_of_file};
#[cfg(feature = "cli")]
pub use command::{run, run_with};
#[cfg(feature = "net")]
pub use control_counts::ControlCounts;
pub use core::{Core, Handled};
#[cfg(feature = "net")]
pub use encoding::encode_list;
#[cfg(feature = "net")]
pub use error::HubError;
#[cfg(feature = "net")]
pub use health::Verdict;
#[cfg(feature = "net")]
pub use monitor::{Monitor, Snapshot};
#[cfg(feature = "cli")]
pub use monitoring::metrics;
#[cfg(feature = "net")]
pub use recorder::RecordingStatus;
#[cfg(feature = "net")]
pub use run::{HubSetup, serve};
pub use settings::{AgentSettings, HubSettings};
#[cfg(feature = "net")]
pub use span_counts::SpanCounts;
#[cfg(feature = "net")]
pub use status::{AgentStatus, HubStatus, Quantiles, RegistrationStatus, StandbyStatus};
pub use tile_settings::TileSettings;
#[cfg(feature = "net")]
pub use unnamed::InvalidName;
