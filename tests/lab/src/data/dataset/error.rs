//! Why a data set cannot be read.

use crate::data::csv_table::CsvError;
use crate::data::dataset::nuscenes::NuscenesError;
use std::path::PathBuf;

/// Why a data set cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// An unknown name of a data set.
    #[error("unknown data set {0:?}; expected synthetic, nuscenes:ROOT or csv:FILE")]
    UnknownSource(String),
    /// A table of boxes.
    #[error(transparent)]
    Csv(#[from] CsvError),
    /// Tables of nuScenes.
    #[error(transparent)]
    Nuscenes(#[from] NuscenesError),
    /// A data set without boxes.
    #[error("{} holds no boxes", .0.display())]
    Empty(PathBuf),
}
