//! Mistakes in the name of a link.

use super::super::trace::TraceError;
use std::path::PathBuf;

/// Why a text does not name a link.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// No such link.
    #[error(
        "no link {name:?}; there are ideal, its-g5, pc5, lte-uu, 5g-mec, 5g-cloud, cell-gamma:, v2xvit-noisy, cobevflow:, dair-async-1, dair-async-2, trace:, custom: (see v2x links)"
    )]
    Unknown {
        /// The name found.
        name: String,
    },
    /// A setting that this link does not have, or that is given twice.
    #[error("{name}: {key} cannot be set here, or twice; expected {expected}")]
    Setting {
        /// The link.
        name: String,
        /// The setting.
        key: String,
        /// The possible settings.
        expected: &'static str,
    },
    /// A value outside of its limits.
    #[error("{key} is {value:?}, expected {expected}")]
    Value {
        /// The setting.
        key: &'static str,
        /// The value found.
        value: String,
        /// The allowed values.
        expected: &'static str,
    },
    /// A file that cannot be read.
    #[error("trace {}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// A recording that cannot be used.
    #[error("trace {}: {source}", .path.display())]
    Trace {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: TraceError,
    },
}
