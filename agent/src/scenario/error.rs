//! What can be wrong with a scenario file.

use std::fmt;
use std::path::{Path, PathBuf};

/// Why a scenario was refused. Every message names the file, the place in it, and the value.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("cannot read scenario {}: {cause}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why not.
        cause: std::io::Error,
    },
    /// Not TOML, an unknown or missing field, or a value of the wrong type; the cause names the line.
    #[error("{origin}: {cause}")]
    Syntax {
        /// Where the text came from.
        origin: Origin,
        /// Line, column and cause.
        cause: Box<toml::de::Error>,
    },
    /// A value that cannot be.
    #[error("{origin}: {field} is {value}, expected {expected}")]
    Value {
        /// Where the text came from.
        origin: Origin,
        /// The field's path, as in `agents[1].rate_hz`.
        field: String,
        /// What it holds.
        value: String,
        /// What it may hold.
        expected: String,
    },
}

/// Where a scenario's text came from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin(Option<PathBuf>);

impl Origin {
    /// From a file.
    pub fn file(path: &Path) -> Self {
        Self(Some(path.to_owned()))
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Some(path) => write!(f, "scenario {}", path.display()),
            None => f.write_str("scenario"),
        }
    }
}
