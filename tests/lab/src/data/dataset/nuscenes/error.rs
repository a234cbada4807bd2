//! Why scenes of nuScenes cannot be read.

use super::split::Split;
use super::table::TableError;
use std::path::PathBuf;

/// Why scenes of nuScenes cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum NuscenesError {
    /// A table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// No scene to evaluate.
    #[error("no scene of split {split} is in {}", .folder.display())]
    NoScenes {
        /// Where the tables are.
        folder: PathBuf,
        /// What was asked for.
        split: Split,
    },
}
