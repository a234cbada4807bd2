//! Positions of two agents that lie beside each other: by a shift, a turn, or a time.

use super::super::alignment::change::Rigid;
use super::super::finding::{Code, Finding, Severity};
use super::pairs::Pair;
use v2x_common::id::AgentId;

/// Times that differ by less are worth a note, s: sensors that turn stamp what they see by as much.
const GRAVE_S: f64 = 0.15;

impl Pair {
    /// The agent's positions go onto the other one's by `rigid`, so they are off by the opposite.
    pub(super) fn offset(&self, rigid: &Rigid, is_undecided: bool) -> Option<Finding> {
        let Rigid { by_m: [x, y], turn_rad, earlier_s, or_earlier_s } = *rigid;
        let mut parts = Vec::new();
        if (x, y) != (0.0, 0.0) {
            parts.push(format!("{:+.2} m east and {:+.2} m north of", -x, -y));
        }
        if turn_rad != 0.0 {
            parts.push(format!("turned by {:+.1}° against", -turn_rad.to_degrees()));
        }
        if parts.is_empty() {
            return (earlier_s != 0.0).then(|| self.of_time(earlier_s, is_undecided));
        }
        let Self { agent, other, share, source, .. } = self;
        let is_open = earlier_s == 0.0 && or_earlier_s == 0.0 && !self.is_time_known;
        if earlier_s != 0.0 {
            parts.push(along(earlier_s));
        }
        let may_be_time = or_earlier_s != 0.0;
        let or = if may_be_time { format!(", or {}", along(or_earlier_s)) } else { String::new() };
        let but = if may_be_time {
            "; all that both see moves one way and nearly at one speed, so that a shift of place and a time are the same".to_owned()
        } else if is_open {
            "; how fast they move is not known well enough to say whether places differ, or clocks".to_owned()
        } else {
            String::new()
        };
        let says = format!(
            "the objects of {agent} lie {}{or} those of {other} ({:.0} % of what both see){but}",
            parts.join(", "),
            100.0 * share
        );
        let places = source.words(
            "Are both clocks set, and both poses surveyed in one map frame? Are x and y the middle of each box, and not a corner? An agent that \
             describes the accuracy of its pose is corrected by the hub",
            "Are both clocks set, and both poses surveyed in one map frame? Are x and y the middle of each box, and not a corner? A sensor whose \
             accuracy is given by --accuracy is corrected",
        );
        let change = match may_be_time {
            true => format!("{places} Or: {}", self.advice(or_earlier_s, is_undecided)),
            false => places.to_owned(),
        };
        let severity = if is_open { Severity::Note } else { Severity::Fault };
        let agent = (!is_undecided).then_some(*agent);
        Some(Finding { code: Code::Offset, severity, agent, says, change })
    }

    /// Positions of another time than those of the other agent under the same stamps.
    fn of_time(&self, earlier_s: f64, is_undecided: bool) -> Finding {
        let Self { agent, other, share, .. } = self;
        let says = format!(
            "the objects of {agent} lie {} those of {other}: what moves is displaced by its speed times that, and what stands is not ({:.0} % of \
             what both see)",
            along(earlier_s),
            100.0 * share
        );
        let severity = if earlier_s.abs() < GRAVE_S { Severity::Note } else { Severity::Fault };
        let agent = (!is_undecided).then_some(*agent);
        Finding { code: Code::Offset, severity, agent, says, change: self.advice(earlier_s, is_undecided) }
    }

    /// What to look at where positions are of another time.
    fn advice(&self, earlier_s: f64, is_undecided: bool) -> String {
        let ahead = |agent: &AgentId| {
            format!(
                "does {agent} send positions that are predicted to a later time than {}, or is its clock behind",
                self.source.words("`captured_at`", "t")
            )
        };
        let behind = |agent: &AgentId| {
            format!(
                "are the positions of {agent} older than {}, as those of a filter that smooths are, and those that are stamped when they are sent, or \
                 is its clock ahead",
                self.source.words("`captured_at`", "t")
            )
        };
        let (first, second) = match earlier_s > 0.0 {
            true => (ahead(&self.agent), behind(&self.other)),
            false => (behind(&self.agent), ahead(&self.other)),
        };
        let or = if is_undecided { format!("; or {second}") } else { String::new() };
        format!(
            "{}, where each object was then: {first}{or}? Are x and y the middle of a vehicle, and not its front or rear?",
            self.source.words(
                "Send with `captured_at`, when the sensor saw them",
                "Write in each row with t, when the sensor saw it"
            )
        )
    }
}

/// Where objects lie of which positions are of so much later, as what undoes it says: they were there so much earlier.
fn along(earlier_s: f64) -> String {
    let side = if earlier_s > 0.0 { "ahead of" } else { "behind" };
    format!("{:.0} ms of their motion {side}", 1e3 * earlier_s.abs())
}
