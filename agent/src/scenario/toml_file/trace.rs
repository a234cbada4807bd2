//! Trace files that a scenario names.

use std::path::Path;

/// The text of a trace file.
pub(super) fn read_trace(path: &Path) -> std::io::Result<String> {
    std::fs::read_to_string(path)
}
