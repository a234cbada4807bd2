//! Fusion methods behind one surface: tracking, rules for the frames of one window, and methods of your own.
//!
//! Whatever the method, the [`Engine`](crate::engine::Engine) around it is the same: it admits frames, keeps statistics
//! of the agents, and publishes. So every method runs in the live hub and in the laboratory.

mod config;
mod late;
mod method;
mod presets;
mod start;
#[cfg(feature = "core")]
pub(crate) mod table;
mod tracking;
mod window;

pub use crate::publish::ObjectList;
pub use crate::tracker::{Hypotheses, Innovations, Lifetimes, ParticleCount, TrackerConfig};
pub use config::{Births, Fusion, MotionModel, TrackingConfig};
pub use late::LateFrames;
pub use method::{AdmittedFrame, FrameOutcome, FusionMethod, NoMemory, TrackCounts};
pub use presets::{DEFAULT_OVERLAP, EPSILON_S, PRESETS, Preset, PresetKey, preset};
#[cfg(feature = "core")]
pub use table::SettingsError;
pub use window::{MAX_WINDOW_BOXES, WindowConfig, WindowFusion};
