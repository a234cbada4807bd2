//! One agent, and the findings that are its own.

use super::super::finding::{Code, Finding};
use super::super::window::{AgentSurvey, Surroundings};
use v2x_common::id::AgentId;

/// Fewest values that show anything.
pub(super) const MIN_VALUES: u64 = 10;

/// Whether a part is such a share of enough values.
#[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
pub(super) fn is_share(part: u64, of: u64, least: f64) -> bool {
    of >= MIN_VALUES && part as f64 >= least * of as f64
}

/// One agent with what is known of it.
pub(super) struct One<'a> {
    pub(super) agent: AgentId,
    pub(super) survey: &'a AgentSurvey,
    pub(super) around: &'a Surroundings<'a>,
}

impl One<'_> {
    pub(super) fn fault(&self, code: Code, says: String, change: impl Into<String>) -> Finding {
        Finding::fault(code, self.agent, says, change)
    }

    pub(super) fn note(&self, code: Code, says: String, change: impl Into<String>) -> Finding {
        Finding::note(code, self.agent, says, change)
    }

    /// The line of the hub's configuration that says so.
    pub(super) fn setting(&self, line: &str) -> String {
        format!("`{line}` {}", self.table())
    }

    /// Where lines of its settings go.
    pub(super) fn table(&self) -> String {
        self.around.source.table_of(&self.agent)
    }

    /// The words of the two that hold where its frames come from.
    pub(super) const fn words(&self, of_network: &'static str, of_log: &'static str) -> &'static str {
        self.around.source.words(of_network, of_log)
    }
}
