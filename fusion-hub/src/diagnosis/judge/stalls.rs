//! Frames of all agents that are late at times: what they share stalls.

use super::super::finding::{Code, Finding};
use super::super::window::Window;
use v2x_common::duration::in_words;
use v2x_common::time::Span;

/// Fewest agents that show it: two that are late at the same time by themselves would be a coincidence.
const MIN_AGENTS: usize = 2;
/// Whose fastest frame is later than this has a slow link, or a clock that is behind, at any time.
const PROMPT: Span = Span::from_millis(150);
/// Whoever is refused more than this share is late in another way.
const MOST_REFUSED: f64 = 0.5;
/// Agents that are named.
const MOST_NAMED: usize = 8;

/// Puts one finding in the place of one of each agent, where all of them are late at times, and none of them always.
pub(super) fn merge(window: &Window, findings: &mut Vec<Finding>) {
    let is_of_stall = |one: &Finding| {
        let refused = || window.agents.get(&one.agent?)?.refused.get("too_late");
        match one.code {
            Code::Jitter => true,
            Code::FramesRefused => refused().is_some() && one.says.contains("(too_late)"),
            _ => false,
        }
    };
    let heard = window.agents.iter().filter(|(_, survey)| survey.arrivals.frames > 0);
    let (mut n, mut refused, mut most) = (0_usize, 0_u64, Span::ZERO);
    let mut names = Vec::new();
    for (agent, survey) in heard {
        let Some((least, longest)) = survey.arrivals.delay() else { return };
        let late = survey.refused.get("too_late").map_or(0, |(count, _)| *count);
        let is_late = findings.iter().any(|one| one.agent == Some(*agent) && is_of_stall(one));
        #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
        let is_seldom = (late as f64) < MOST_REFUSED * survey.arrivals.frames as f64;
        if !is_late || least > PROMPT || !is_seldom {
            return;
        }
        (n, refused, most) = (n + 1, refused + late, most.max(longest));
        if names.len() < MOST_NAMED {
            names.push(agent.to_string());
        }
    }
    if n < MIN_AGENTS {
        return;
    }
    let says = format!(
        "frames of all {n} agents ({}{}) arrive late at times, by up to {}, and promptly at others; {refused} are refused as too late",
        names.join(", "),
        if n > MOST_NAMED { ", …" } else { "" },
        in_words(most.as_secs_f64())
    );
    let change = "What they share stalls, and not their clocks: the hub's machine, the network before it, or the machine on which all of them \
                  run. Which programs take its processors' time?";
    findings.retain(|one| !is_of_stall(one));
    let found = Finding::of_network(Code::Overload, says, change);
    findings.push(if refused > 0 { found } else { found.as_note() });
}

#[cfg(test)]
mod tests {
    use super::super::super::observation::Observation;
    use super::*;
    use crate::engine::Refusal;
    use v2x_common::detection::DetectionFrame;
    use v2x_common::id::{AgentId, FrameId};
    use v2x_common::time::Timestamp;

    /// Findings of agents whose frames take so long each, ms; with so many refused as too late.
    fn merged(delays_ms: &[&[i64]], refused: u64) -> Vec<Finding> {
        let mut window = Window::default();
        let mut findings = Vec::new();
        for (n, delays) in delays_ms.iter().enumerate() {
            let agent = AgentId::new(&format!("a{n}")).unwrap();
            let survey = window.agent(agent).unwrap();
            for (k, delay_ms) in (0_u64..).zip(delays.iter().cycle().take(100)) {
                let at = Timestamp::EPOCH + Span::from_millis(1_000_000 + 100 * k.cast_signed());
                let frame = DetectionFrame::empty(FrameId { agent, epoch: 1, sequence: k }, at);
                let received_at = at + Span::from_millis(*delay_ms);
                survey.arrivals.note(&Observation {
                    frame: &frame,
                    reported: &Default::default(),
                    received_at,
                });
            }
            let late = Refusal::TooLate { age: Span::from_millis(600) };
            survey.refused.insert(late.reason(), (refused, late));
            if delays.iter().any(|delay_ms| *delay_ms > 300) {
                findings.push(Finding::fault(
                    Code::FramesRefused,
                    agent,
                    "refused (too_late)".to_owned(),
                    "",
                ));
                findings.push(Finding::note(Code::Jitter, agent, "varies".to_owned(), ""));
            }
        }
        merge(&window, &mut findings);
        findings
    }

    #[test]
    fn where_the_frames_of_all_agents_are_late_at_times_what_they_share_stalls_and_nobody_is_blamed() {
        let found = merged(&[&[10, 12, 15, 700], &[20, 22, 25, 900]], 4);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].agent.is_none() && found[0].is_fault() && found[0].code == Code::Overload);
        assert!(found[0].says.contains("all 2 agents (a0, a1)"), "{}", found[0]);
        assert!(!merged(&[&[10, 700], &[20, 900]], 0)[0].is_fault(), "nothing is lost by it");
    }

    #[test]
    fn one_agent_that_is_late_and_one_that_always_is_are_said_to_be() {
        assert_eq!(merged(&[&[10, 12, 15, 700], &[20, 22]], 4).len(), 2, "one of two");
        assert_eq!(merged(&[&[10, 12, 15, 700]], 4).len(), 2, "one alone");
        assert_eq!(merged(&[&[400, 500, 700], &[20, 700]], 4).len(), 4, "one is always late");
        assert_eq!(merged(&[&[10, 700], &[20, 700]], 60).len(), 4, "most frames are refused");
    }
}
