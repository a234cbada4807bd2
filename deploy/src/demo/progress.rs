//! The progress of a run: one line, rewritten in a terminal, printed again every few seconds elsewhere.

use serde_json::Value;
use std::io::{IsTerminal, Write};
use std::time::Duration;

/// Seconds between two lines where a line cannot be rewritten.
const LINE_EVERY_S: u64 = 5;

pub(super) struct Progress {
    /// How long the run is; `None` where Ctrl-C ends it.
    total: Option<Duration>,
    rewrites: bool,
    last_line_s: u64,
}

impl Progress {
    pub(super) fn new(total: Option<Duration>) -> Self {
        Self { total, rewrites: std::io::stderr().is_terminal(), last_line_s: 0 }
    }

    /// Prints a line of its own.
    pub(super) fn print(&self, text: &str) {
        let _ = writeln!(std::io::stderr(), "{text}");
    }

    /// Shows what the consumer has received so far.
    pub(super) fn show(&mut self, elapsed: Duration, event: &Value) {
        let line = self.line(elapsed, event);
        let mut out = std::io::stderr().lock();
        if self.rewrites {
            let _ = write!(out, "\r\x1b[2K{line}").and_then(|()| out.flush());
        } else if elapsed.as_secs() >= self.last_line_s + LINE_EVERY_S {
            self.last_line_s = elapsed.as_secs();
            let _ = writeln!(out, "{line}");
        }
    }

    fn line(&self, elapsed: Duration, event: &Value) -> String {
        let until = match self.total {
            Some(total) => format!("of {:.0} s", total.as_secs_f64()),
            None => "s, until Ctrl-C".to_owned(),
        };
        format!(
            "  {:>4.0} {until}: {} objects in the fused list; received {} fused and {} detection frames",
            elapsed.as_secs_f64(),
            event["objects"],
            event["fused_frames"],
            event["detection_frames"],
        )
    }

    /// Ends the line.
    pub(super) fn end(&self) {
        if self.rewrites {
            let _ = writeln!(std::io::stderr());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_run_that_ctrl_c_ends_has_no_length_in_its_progress() {
        let event = json!({"objects": 30, "fused_frames": 800, "detection_frames": 790});
        let line = |total| Progress::new(total).line(Duration::from_secs(40), &event);
        assert!(line(Some(Duration::from_secs(60))).contains("40 of 60 s: 30 objects"));
        assert!(line(None).contains("40 s, until Ctrl-C: 30 objects"));
    }
}
