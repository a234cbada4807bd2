//! Nothing is fused, though agents report what lasts.

use super::super::finding::{Code, Finding};
use super::super::window::Window;
use v2x_common::id::AgentId;

/// Objects that an agent reports in one frame after the other, in the mean of its frames, from which on one should be published.
const MIN_LASTING: f64 = 1.0;
/// Fewest lists that show it: some seconds at the slowest usual rate.
const MIN_LISTS: u64 = 20;
/// Agents that are named.
const MOST_NAMED: usize = 8;

/// The finding of a window in which no list had an object.
pub(super) fn finding(window: &Window) -> Option<Finding> {
    if !window.is_over || window.lists < MIN_LISTS || window.lists_with_objects > 0 {
        return None;
    }
    let agents = window.agents.iter().filter(|(_, survey)| survey.refused.is_empty());
    let lasting = agents.map(|(agent, _)| (*agent, window.snapshots.lasting(agent)));
    let lasting: Vec<(AgentId, f64)> = lasting.filter(|(_, n)| *n >= MIN_LASTING).collect();
    if lasting.is_empty() {
        return None;
    }
    let named: Vec<_> =
        lasting.iter().take(MOST_NAMED).map(|(agent, n)| format!("{agent} some {n:.0}")).collect();
    let more = if lasting.len() > MOST_NAMED { ", …" } else { "" };
    let says = format!(
        "no object is published in {} lists, though agents report objects that last from frame to frame ({}{more})",
        window.lists,
        named.join(", ")
    );
    let change = match lasting.len() {
        1 => "Do its scores, its `detection_probability` or `publish_existence` keep them below what is published?",
        _ => {
            "Each of several agents denies what only another one reports in its view: correct what is said of their places, axes and \
             clocks, or state their fields of view (`sensor`) where they see different places"
        }
    };
    Some(Finding::of_network(Code::NothingFused, says, change))
}
