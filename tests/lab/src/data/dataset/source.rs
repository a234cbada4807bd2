//! A data set by its name on the command line.

use crate::data::dataset::error::DatasetError;
use crate::data::dataset::nuscenes::Split;
use crate::data::dataset::{csv_file, nuscenes, synthetic};
use crate::data::scene::Scene;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// A data set as it is named on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The synthetic scenes of [`crate::data::dataset::synthetic`].
    Synthetic,
    /// A table in the columns of `data::dataset::csv_file`.
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
    /// Its scenes; `version` and `split` are those of nuScenes.
    pub fn load(&self, version: &str, split: &Split) -> Result<Vec<Scene>, DatasetError> {
        match self {
            Self::Synthetic => Ok(synthetic::scenes()),
            Self::Csv(path) => csv_file::load(path),
            Self::NuScenes(root) => Ok(nuscenes::load(root, version, split)?),
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
