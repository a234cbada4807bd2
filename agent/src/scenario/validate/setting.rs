//! A world as it was read.

use crate::scenario::config::{ScenarioFile, Sumo};
use crate::world::WorldConfig;

/// A world, and what it was read from.
pub(super) struct Setting {
    pub(super) config: WorldConfig,
    pub(super) files: Vec<ScenarioFile>,
    /// Where SUMO drives it.
    pub(super) sumo: Option<Sumo>,
}

impl Setting {
    /// Of a world that no file describes.
    pub(super) const fn synthetic(config: WorldConfig) -> Self {
        Self { config, files: Vec::new(), sumo: None }
    }
}
