//! Progress of a computation, on standard error: a bar in a terminal, a line from time to time elsewhere.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use v2x_common::clock;
use v2x_common::time::{Span, Timestamp};

/// Time between two lines where standard error is no terminal.
const LOG_INTERVAL: Span = Span::from_millis(10_000);
/// Updates of the bar a second.
const BAR_HZ: u8 = 5;

/// How far a computation is.
pub(crate) struct Progress {
    /// Name of the parts.
    parts: &'static str,
    began_at: Timestamp,
    logged_at: Timestamp,
    /// In a terminal.
    bar: Option<ProgressBar>,
}

impl Progress {
    pub(crate) fn begin(parts: &'static str) -> Self {
        let now = clock::now();
        let bar = std::io::stderr().is_terminal().then(|| {
            let style =
                ProgressStyle::with_template("{bar:30} {percent} %, {pos} of {len} {msg}, {eta} left");
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(BAR_HZ));
            bar.with_style(style.expect("the template is well formed")).with_message(parts)
        });
        Self { parts, began_at: now, logged_at: now, bar }
    }

    /// Shows the number of finished parts, and of all parts.
    #[expect(clippy::print_stderr, reason = "progress is for people")]
    pub(crate) fn update(&mut self, done: usize, of: usize) {
        if let Some(bar) = &self.bar {
            bar.set_length(of as u64);
            bar.set_position(done as u64);
            return;
        }
        let now = clock::now();
        if now - self.logged_at >= LOG_INTERVAL && done > 0 && of > 0 {
            self.logged_at = now;
            eprintln!("{}", line((done, of), self.parts, now - self.began_at));
        }
    }

    /// Clears the bar.
    pub(crate) fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// What is done, and how long the rest takes at the same pace.
#[expect(clippy::cast_precision_loss, reason = "numbers of parts")]
fn line((done, of): (usize, usize), parts: &str, elapsed: Span) -> String {
    let share = done as f64 / of as f64;
    let left_s = elapsed.as_secs_f64() * (1.0 - share) / share;
    format!("{:3.0} %, {done} of {of} {parts}, {left_s:.0} s left", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_is_expected_to_take_as_long_a_part_as_what_is_done() {
        assert_eq!(line((25, 100), "runs", Span::from_millis(10_000)), " 25 %, 25 of 100 runs, 30 s left");
    }

    #[test]
    fn a_computation_may_end_before_its_first_part() {
        let mut progress = Progress::begin("runs");
        progress.update(0, 0);
        progress.end();
    }
}
