//! Why a data set cannot be read.

use super::nuscenes::{Split, TableError};
use std::path::PathBuf;

/// Why a data set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// Not a name of a data set.
    #[error("unknown data set {0:?}; expected synthetic, nuscenes:ROOT or csv:FILE")]
    UnknownSource(String),
    /// A file that cannot be opened.
    #[error("cannot read {}", .path.display())]
    Open {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not a table at all.
    #[error("{} is no table", .path.display())]
    NoTable {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: csv::Error,
    },
    /// A table without a column that is needed.
    #[error("{} has no column {column:?}; needed are {needed}", .path.display())]
    MissingColumn {
        /// Which file.
        path: PathBuf,
        /// Which column.
        column: &'static str,
        /// All that are needed.
        needed: String,
    },
    /// A value that cannot be.
    #[error("{}, line {line}, column {column}: {value:?}, expected {expected}", .path.display())]
    Field {
        /// Which file.
        path: PathBuf,
        /// Counted from 1, the header included.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// What stands there.
        value: String,
        /// What may stand there.
        expected: &'static str,
    },
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
