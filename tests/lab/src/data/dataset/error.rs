//! Why a data set cannot be read.

use super::nuscenes::{Split, TableError};
use crate::csv_table::CsvError;
use std::path::PathBuf;

/// Why a data set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// Not a name of a data set.
    #[error("unknown data set {0:?}; expected synthetic, nuscenes:ROOT or csv:FILE")]
    UnknownSource(String),
    /// A table of boxes.
    #[error(transparent)]
    Csv(#[from] CsvError),
    /// A table of nuScenes.
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
    /// Nothing to evaluate.
    #[error("{} holds no boxes", .0.display())]
    Empty(PathBuf),
}
