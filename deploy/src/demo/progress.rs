//! The progress of a run: one line, rewritten in a terminal, printed again every few seconds elsewhere.

use serde_json::Value;
use std::io::{IsTerminal, Write};
use std::time::Duration;

/// Seconds between two lines where a line cannot be rewritten.
const LINE_EVERY_S: u64 = 5;

pub(super) struct Progress {
    total: Duration,
    rewrites: bool,
    last_line_s: u64,
}

impl Progress {
    pub(super) fn new(total: Duration) -> Self {
        Self { total, rewrites: std::io::stderr().is_terminal(), last_line_s: 0 }
    }

    /// Prints a line of its own.
    pub(super) fn print(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "{text}");
    }

    /// Shows what the consumer has received so far.
    pub(super) fn show(&mut self, elapsed: Duration, event: &Value) {
        let line = format!(
            "  {:>4.0} of {:.0} s: {} objects in the fused list; received {} fused and {} detection frames",
            elapsed.as_secs_f64(),
            self.total.as_secs_f64(),
            event["objects"],
            event["fused_frames"],
            event["detection_frames"],
        );
        let mut out = std::io::stderr().lock();
        if self.rewrites {
            let _ = write!(out, "\r\x1b[2K{line}").and_then(|()| out.flush());
        } else if elapsed.as_secs() >= self.last_line_s + LINE_EVERY_S {
            self.last_line_s = elapsed.as_secs();
            let _ = writeln!(out, "{line}");
        }
    }

    /// Ends the line.
    pub(super) fn end(&self) {
        if self.rewrites {
            let _ = writeln!(std::io::stderr());
        }
    }
}
