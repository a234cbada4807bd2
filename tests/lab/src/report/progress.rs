//! Progress of a computation, on standard error.

use std::io::IsTerminal;
use v2x_common::clock;
use v2x_common::time::{Span, Timestamp};

/// Time between two lines where standard error is no terminal.
const LOG_INTERVAL: Span = Span::from_millis(10_000);
/// Time between two updates of a terminal's line.
const TERMINAL_INTERVAL: Span = Span::from_millis(200);

/// One line that is updated.
pub(crate) struct Progress {
    /// Name of the parts.
    parts: &'static str,
    began_at: Timestamp,
    updated_at: Timestamp,
    is_terminal: bool,
}

impl Progress {
    pub(crate) fn begin(parts: &'static str) -> Self {
        let now = clock::now();
        Self { parts, began_at: now, updated_at: now, is_terminal: std::io::stderr().is_terminal() }
    }

    /// Shows the number of finished parts, and of all parts.
    #[expect(clippy::cast_precision_loss, reason = "numbers of parts")]
    #[expect(clippy::print_stderr, reason = "progress is for people")]
    pub(crate) fn update(&mut self, done: usize, of: usize) {
        let now = clock::now();
        let interval = if self.is_terminal { TERMINAL_INTERVAL } else { LOG_INTERVAL };
        if now - self.updated_at < interval || done == 0 || of == 0 {
            return;
        }
        self.updated_at = now;
        let share = done as f64 / of as f64;
        let left_s = (now - self.began_at).as_secs_f64() * (1.0 - share) / share;
        let parts = self.parts;
        let line = format!("{:3.0} %, {done} of {of} {parts}, {left_s:.0} s left", 100.0 * share);
        if self.is_terminal {
            eprint!("\r{line}\x1b[K");
        } else {
            eprintln!("{line}");
        }
    }

    /// Clears the line.
    #[expect(clippy::print_stderr, reason = "progress is for people")]
    pub(crate) fn end(&self) {
        if self.is_terminal {
            eprint!("\r\x1b[K");
        }
    }
}
