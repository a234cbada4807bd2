//! Mistakes in a scenario file.

use std::fmt;
use std::path::{Path, PathBuf};

use super::edit::EditError;
use crate::trajectories::TrafficError;
use v2x_common::spelling;

/// Why a scenario file was refused. Every message names the file, the place in it, and the value.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("cannot read scenario {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        cause: std::io::Error,
    },
    /// Recorded traffic, or a folder, where a scenario is expected.
    #[error(
        "{} is no scenario; of recorded traffic one is written by: v2x scenario init --world {}",
        path.display(),
        path.display()
    )]
    IsTraffic {
        /// The file or folder.
        path: PathBuf,
    },
    /// Not TOML, an unknown or missing field, or a value of the wrong type; the cause names the line.
    #[error("{origin}: {}", spelling::hinted(&.cause.to_string(), &[]))]
    Syntax {
        /// Source of the text.
        origin: Origin,
        /// Line, column and cause.
        cause: Box<toml::de::Error>,
    },
    /// A value outside of its limits.
    #[error("{origin}{}: {field} is {value}, expected {expected}", Place(*place))]
    Value {
        /// Source of the text.
        origin: Origin,
        /// Line and column of the value, counted from 1, where they are known.
        place: Option<(u32, u32)>,
        /// The field's path, as in `agents[1].rate_hz`.
        field: String,
        /// The value found.
        value: String,
        /// The allowed values.
        expected: String,
    },
    /// A scenario cannot be given another world.
    #[error("scenario {}: {cause}", path.display())]
    World {
        /// The file.
        path: PathBuf,
        /// The cause.
        cause: Box<EditError>,
    },
    /// A file of recorded traffic cannot be used.
    #[error("{}: {cause}", path.display())]
    Traffic {
        /// The file.
        path: PathBuf,
        /// The cause; it names the line and the column.
        cause: Box<TrafficError>,
    },
}

impl ScenarioError {
    /// The same without line and column, of a text that no user has seen.
    #[must_use]
    pub fn without_place(mut self) -> Self {
        if let Self::Value { place, .. } = &mut self {
            *place = None;
        }
        self
    }
}

/// Line and column, for messages.
struct Place(Option<(u32, u32)>);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.map_or(Ok(()), |(line, column)| write!(f, ", line {line}, column {column}"))
    }
}

/// The source of a scenario's text.
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
