//! Where scenes come from.

pub mod csv_file;
mod error;
pub mod synthetic;

pub use error::DatasetError;

use crate::protocol::scene::Scene;
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
}

impl FromStr for Source {
    type Err = DatasetError;

    fn from_str(text: &str) -> Result<Self, DatasetError> {
        if text == "synthetic" {
            return Ok(Self::Synthetic);
        }
        match text.split_once(':') {
            Some(("csv", path)) => Ok(Self::Csv(path.into())),
            _ => Err(DatasetError::UnknownSource(text.to_owned())),
        }
    }
}

impl Source {
    /// Its scenes.
    pub fn load(&self) -> Result<Vec<Scene>, DatasetError> {
        match self {
            Self::Synthetic => Ok(synthetic::scenes()),
            Self::Csv(path) => csv_file::load(path),
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Synthetic => f.write_str("synthetic"),
            Self::Csv(path) => write!(f, "csv:{}", path.display()),
        }
    }
}
