//! Trace files that a scenario names.

use std::path::PathBuf;

/// The text of a trace file.
pub(super) fn read_trace(path: &PathBuf) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| error.to_string())
}
