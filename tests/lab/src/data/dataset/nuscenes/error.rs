//! Why scenes of nuScenes cannot be read.

use super::split::Split;
use std::path::PathBuf;
use v2x_agent::nuscenes::TableError;

/// Why scenes of nuScenes cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum NuscenesError {
    /// A table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The split has no scene.
    #[error("no scene of split {split} is in {}", .folder.display())]
    NoScenes {
        /// Folder of the tables.
        folder: PathBuf,
        /// The requested split.
        split: Split,
    },
}
