//! Where scenes come from.

pub mod csv_file;
mod error;
pub mod nuscenes;
pub mod synthetic;

pub use error::DatasetError;

use crate::protocol::scene::Scene;
use nuscenes::Split;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// A data set as it is named on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The made-up scenes of [`synthetic`].
    Synthetic,
    /// A table in the columns of [`csv_file`].
    Csv(PathBuf),
    /// nuScenes' tables below this folder.
    NuScenes(PathBuf),
}

impl FromStr for Source {
    type Err = DatasetError;

    fn from_str(text: &str) -> Result<Self, DatasetError> {
        if text == "synthetic" {
            return Ok(Self::Synthetic);
        }
        match text.split_once(':') {
            Some(("csv", path)) => Ok(Self::Csv(path.into())),
            Some(("nuscenes", root)) => Ok(Self::NuScenes(root.into())),
            _ => Err(DatasetError::UnknownSource(text.to_owned())),
        }
    }
}

impl Source {
    /// Its scenes; `version` and `split` are nuScenes'.
    pub fn load(&self, version: &str, split: &Split) -> Result<Vec<Scene>, DatasetError> {
        match self {
            Self::Synthetic => Ok(synthetic::scenes()),
            Self::Csv(path) => csv_file::load(path),
            Self::NuScenes(root) => nuscenes::load(root, version, split),
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Synthetic => f.write_str("synthetic"),
            Self::Csv(path) => write!(f, "csv:{}", path.display()),
            Self::NuScenes(root) => write!(f, "nuscenes:{}", root.display()),
        }
    }
}
