//! What the statistics mean, in words.

mod arrivals;
mod box_pairs;
mod boxes;
mod contents;
mod headings;
mod nothing;
mod offsets;
mod one;
mod pairs;
mod remedy;
mod reports;
mod stalls;
mod units;
mod writing;

use super::alignment::change::{Change, Rigid};
use super::alignment::fit::Fit;
use super::finding::{Code, Finding};
use super::window::{MAX_AGENTS, Surroundings, Window};
use crate::engine::Refusal;
use crate::registration::MAX_REGISTERED;
use arrivals::ClockByObjects;
use one::One;
use v2x_common::id::AgentId;

/// What is found in a window, the worst first.
pub(super) fn findings(window: &Window, around: &Surroundings<'_>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (agent, survey) in &window.agents {
        let one = One { agent: *agent, survey, around };
        let heard = survey.arrivals.frames > 0;
        findings.extend(reports::findings(&one));
        if heard {
            findings.extend(contents::findings(&one));
            findings.extend(headings::findings(&one));
            findings.extend(boxes::findings(&one));
            findings.extend(writing::findings(&one));
            findings.extend(arrivals::findings(&one, clock_by_objects(window, agent)));
        }
    }
    if window.is_over {
        findings.extend(silent(window));
    }
    findings.extend(idle(around));
    findings.extend(unregistered(&around.engine.unregistered().collect::<Vec<_>>()));
    // An agent that was idle for a while has sent less, and its numbers have gaps.
    findings.retain(|one| {
        !(IDLENESS.contains(&one.code) && one.agent.is_some_and(|agent| window.idle.contains(&agent)))
    });
    let with = |codes: &[Code]| {
        findings.iter().filter(|one| codes.contains(&one.code)).filter_map(|one| one.agent).collect()
    };
    let known = pairs::Known {
        no_metres: with(&[Code::Geodetic]),
        clocks: with(&[Code::ClockAhead, Code::ClockBehind, Code::StampsJitter]),
        headings: with(&HEADINGS),
        source: around.source,
    };
    let sizes: Vec<_> = with(&[Code::Sizes, Code::SizesSwapped]);
    findings.extend(pairs::findings(window, &known));
    findings.extend(units(window, around, &findings));
    findings.extend(box_pairs::findings(window, around.source, |agent| sizes.contains(agent)));
    findings.extend(contents::copies(window, around));
    drop_consequences(window, &mut findings);
    let findings = findings.into_iter().map(|one| no_accuracy_of_repetition(window, one));
    let findings = findings.map(|one| no_accuracy_unconfirmed(window, one));
    let mut findings: Vec<_> = findings.collect();
    // Where it is known what is wrong, that is why.
    if !findings.iter().any(Finding::is_fault) {
        findings.extend(nothing::finding(window));
    }
    merge_overload(window, &mut findings);
    stalls::merge(window, &mut findings);
    findings.sort_by_key(|one| (one.severity, one.agent, one.code));
    findings
}

/// Agents whose positions are in another unit, as they show by themselves: where nothing else is known of their places.
fn units(window: &Window, around: &Surroundings<'_>, findings: &[Finding]) -> Vec<Finding> {
    let is_known = |agent: AgentId| {
        let of_places = findings.iter().filter(|one| one.is_fault() && PLACES.contains(&one.code));
        of_places.into_iter().any(|one| one.agent.is_none_or(|whose| whose == agent))
    };
    let unknown = window.agents.iter().filter(|(agent, _)| !is_known(**agent));
    unknown.filter_map(|(agent, survey)| units::too_fast(&One { agent: *agent, survey, around })).collect()
}

/// What an agent that is idle shows, too.
const IDLENESS: [Code; 3] = [Code::Silent, Code::Gaps, Code::RateLow];
const HEADINGS: [Code; 4] =
    [Code::HeadingsMirrored, Code::HeadingsRotated, Code::HeadingsReversed, Code::HeadingsUnfit];
/// What boxes show beside their places.
const BOXES: [Code; 8] = [
    Code::Velocities,
    Code::Degrees,
    Code::HeadingsMirrored,
    Code::HeadingsRotated,
    Code::HeadingsReversed,
    Code::HeadingsUnfit,
    Code::SizesSwapped,
    Code::Sizes,
];
const SIGMAS: [Code; 2] = [Code::SigmaTooSmall, Code::SigmaTooLarge];
const CLOCKS: [Code; 4] = [Code::ClockAhead, Code::ClockBehind, Code::ClockBehindOrLinkSlow, Code::LinkSlow];
/// Those of them that shared objects show.
const CLOCKS_BY_OBJECTS: [Code; 2] = [Code::ClockBehind, Code::LinkSlow];
/// Where positions are wrong altogether, nothing that is compared with them means anything.
const PLACES: [Code; 5] = [Code::Geodetic, Code::SensorFrame, Code::Axes, Code::LengthUnit, Code::SensorPose];

/// Leaves out what only follows from something else that is found: whoever reads a list of faults begins anywhere.
fn drop_consequences(window: &Window, findings: &mut Vec<Finding>) {
    let is_sure = |one: &&Finding| one.is_fault() || !PLACES.contains(&one.code);
    let has: Vec<_> =
        findings.iter().filter(is_sure).filter_map(|one| Some((one.agent?, one.code))).collect();
    let has_one = |agent: AgentId, codes: &[Code]| codes.iter().any(|code| has.contains(&(agent, *code)));
    let differs = |agent: AgentId| {
        let of_agent = window.fits.iter().filter(|(pair, _)| pair.contains(&agent));
        of_agent.into_iter().any(|(_, fit)| matches!(fit, Fit::Changed { .. }))
    };
    // Wrong headings and sizes spoil the objects that everybody is compared with.
    let of_boxes: Vec<_> =
        has.iter().filter(|(_, code)| BOXES.contains(code)).map(|(agent, _)| *agent).collect();
    let sees_wrong_boxes = |agent: AgentId| {
        let compared = window.fits.keys().filter(|pair| pair.contains(&agent)).flatten();
        of_boxes.contains(&agent) || compared.into_iter().any(|one| of_boxes.contains(one))
    };
    // Shifted by a lane, what moves is compared with what comes the other way.
    let shifted = findings.iter().filter(|one| one.code == Code::Offset && one.is_fault());
    let shifted: Vec<_> = shifted.filter_map(|one| one.agent).collect();
    // Objects move as it says, and not as they do.
    let spoils_motion = has.iter().any(|(_, code)| *code == Code::Velocities);
    // Beside others who see the same area, objects will show which of both it is, once the rest is right.
    let waits_for_objects = |agent: AgentId| sees_area_of_others(window, agent);
    // It makes everybody's errors look otherwise.
    let fed_back = has.iter().any(|(_, code)| *code == Code::Feedback);
    findings.retain(|one| {
        let Some(agent) = one.agent else { return true };
        let places_are_wrong = has_one(agent, &PLACES);
        let is_consequence = (places_are_wrong
            && (HEADINGS.contains(&one.code) || CLOCKS_BY_OBJECTS.contains(&one.code)))
            || ((places_are_wrong || of_boxes.contains(&agent))
                && one.code == Code::ClockBehindOrLinkSlow
                && waits_for_objects(agent))
            || ((shifted.contains(&agent) || spoils_motion) && HEADINGS.contains(&one.code))
            || ((places_are_wrong || differs(agent) || sees_wrong_boxes(agent))
                && SIGMAS.contains(&one.code))
            // The line that reads headings as degrees reads that of the pose so, too.
            || (one.code == Code::SensorPose
                && has_one(agent, &[Code::Degrees])
                && window.agents.get(&agent).is_some_and(|survey| survey.writing.turned_poses > 0))
            || (one.code == Code::FieldOfView
                && (places_are_wrong || has_one(agent, &[Code::FarAway, Code::FarFromSensor])))
            || (one.code == Code::FarFromSensor && (places_are_wrong || has_one(agent, &[Code::FarAway])))
            || (one.code == Code::Twins && (places_are_wrong || has_one(agent, &[Code::Feedback])))
            || (has_one(agent, &[Code::FarFromSensor]) && SIGMAS.contains(&one.code))
            || (has_one(agent, &[Code::LengthUnit])
                && [Code::FarAway, Code::Velocities, Code::ImpossibleDetections, Code::Sizes].contains(&one.code))
            // Of sizes in another unit the largest are impossible.
            || (has_one(agent, &[Code::Sizes])
                && [Code::ImpossibleDetections, Code::Twins].contains(&one.code))
            || (one.code == Code::Copy && (fed_back || has_one(agent, &[Code::TwoProcesses])))
            || (has_one(agent, &[Code::FarFromSensor]) && one.code == Code::ImpossibleDetections)
            || (has_one(agent, &[Code::TimeUnit])
                && (CLOCKS.contains(&one.code) || one.code == Code::Jitter))
            || (one.code == Code::StampsJitter && has_one(agent, &[Code::TwoProcesses]))
            || (has_one(agent, &[Code::StampsJitter]) && one.code == Code::Jitter)
            || (has_one(agent, &[Code::OneStamp, Code::StampsJitter])
                && (SIGMAS.contains(&one.code) || one.code == Code::Offset))
            || (has_one(agent, &[Code::PartialFrames, Code::Feedback, Code::Repetition])
                && (SIGMAS.contains(&one.code) || one.code == Code::Gaps))
            || (has_one(agent, &[Code::StaleObjects])
                && (SIGMAS.contains(&one.code) || [Code::Twins, Code::SourceTracks].contains(&one.code)))
            || (fed_back && SIGMAS.contains(&one.code))
            // What cannot be read has no number.
            || (one.code == Code::Gaps && cannot_be_read(window, agent))
            || (has_one(agent, &[Code::Overload]) && [Code::Gaps, Code::RateLow].contains(&one.code));
        !is_consequence
    });
}

/// Whether frames of an agent are refused before they are read.
fn cannot_be_read(window: &Window, agent: AgentId) -> bool {
    let refused = window.agents.get(&agent).into_iter().flat_map(|survey| survey.refused.values());
    refused.into_iter().any(|(_, last)| matches!(last, Refusal::Malformed(_)))
}

/// What stands, and nobody else sees, is where its agent says each time: its positions repeat, and may be wrong by metres.
fn no_accuracy_of_repetition(window: &Window, finding: Finding) -> Finding {
    let Some(agent) = finding.agent.filter(|_| finding.code == Code::SigmaTooLarge) else { return finding };
    let is_compared = |fit: &Fit| matches!(fit, Fit::Agree { .. } | Fit::Changed { .. });
    let is_shared = window.fits.iter().any(|(pair, fit)| pair.contains(&agent) && is_compared(fit));
    let scatter_m = window.agents.get(&agent).and_then(|survey| survey.scatter.sigma_m()).unwrap_or(0.0);
    if is_shared || window.snapshots.has_motion(&agent, scatter_m) {
        return finding;
    }
    let change = format!(
        "What it sees stands, and nobody else sees it: that positions repeat does not show that they are right. Only where \
         they are known to be: {}",
        finding.change
    );
    Finding { change, ..finding.as_note() }
}

/// Whether positions of others are in the area of those of an agent.
fn sees_area_of_others(window: &Window, agent: AgentId) -> bool {
    let extent = |agent: &AgentId| window.agents.get(agent)?.writing.extent;
    let Some(own) = extent(&agent) else { return false };
    let overlap = |[x, y]: [(f64, f64); 2]| {
        let meets = |(a, b): (f64, f64), (c, d): (f64, f64)| a <= d && c <= b;
        meets(x, own[0]) && meets(y, own[1])
    };
    let others = window.agents.keys().filter(|other| **other != agent);
    others.filter_map(extent).any(overlap)
}

/// By its own tracks alone an agent whose positions are in another unit, of pixels or of another place has a standard deviation,
/// too: where others see the same area, and none of them agrees, the advice is no line to copy.
fn no_accuracy_unconfirmed(window: &Window, finding: Finding) -> Finding {
    let Some(agent) = finding.agent.filter(|_| SIGMAS.contains(&finding.code)) else { return finding };
    if !finding.is_fault() {
        return finding;
    }
    let mut of_agent = window.fits.iter().filter(|(pair, _)| pair.contains(&agent)).peekable();
    let is_confirmed = of_agent.peek().is_none()
        || of_agent.any(|(_, fit)| matches!(fit, Fit::Agree { .. } | Fit::Changed { .. }));
    if is_confirmed || !sees_area_of_others(window, agent) {
        return finding;
    }
    let change = format!(
        "No other agent confirms where its objects are, though they see the same area: first, are x and y metres in the map frame, \
         and not pixels, another unit, other axes, or from another origin? Only where they are known to be right: {}",
        finding.change
    );
    Finding { change, ..finding }
}

/// What is said of agents whose errors are not estimated.
fn unregistered(agents: &[AgentId]) -> Option<Finding> {
    let names: Vec<_> = agents.iter().take(MOST_NAMED).map(AgentId::to_string).collect();
    let more = if agents.len() > MOST_NAMED { ", …" } else { "" };
    let says = format!(
        "the errors of clock and pose of {} agents ({}{more}) are not estimated: there are places for {MAX_REGISTERED}, and those \
         that share objects with others go first",
        agents.len(),
        names.join(", ")
    );
    let change = "Their frames count as they declare; several hubs, each with its own area, have more places";
    (!agents.is_empty()).then(|| Finding::of_network(Code::RegistrationFull, says, change).as_note())
}

/// Where the hub has no time for more agents than this, it is what is slow: one finding instead of one of each.
const FEW_OVERLOADED: usize = 2;
/// Why frames are refused then.
const OF_OVERLOAD: [&str; 2] = ["queue_full", "too_late"];
/// What frames that wait show, whose ever they are.
const BY_OVERLOAD: [Code; 5] =
    [Code::Jitter, Code::Gaps, Code::RateLow, Code::LinkSlow, Code::ClockBehindOrLinkSlow];
/// Agents that are named then.
const MOST_NAMED: usize = 8;

fn merge_overload(window: &Window, findings: &mut Vec<Finding>) {
    let overloaded = findings.iter().filter(|one| one.code == Code::Overload);
    let agents: Vec<_> = overloaded.clone().filter_map(|one| one.agent).collect();
    let Some(change) = overloaded.map(|one| one.change.clone()).next() else { return };
    if agents.len() <= FEW_OVERLOADED {
        return;
    }
    let refused = |agent: &AgentId| Some(window.agents.get(agent)?.refused.get("queue_full")?.0);
    let count: u64 = agents.iter().filter_map(refused).sum();
    let names: Vec<_> = agents.iter().take(MOST_NAMED).map(AgentId::to_string).collect();
    let more = if agents.len() > MOST_NAMED { ", …" } else { "" };
    let says = format!(
        "{count} frames of {} agents ({}{more}) were dropped for lack of time (queue_full)",
        agents.len(),
        names.join(", ")
    );
    // What waits too long for a hub that has no time arrives too late, of whomever.
    let only_late = |agent: AgentId| {
        let mut reasons = window.agents.get(&agent).into_iter().flat_map(|survey| survey.refused.keys());
        reasons.all(|reason| OF_OVERLOAD.contains(reason))
    };
    findings.retain(|one| {
        let is_late = one.code == Code::FramesRefused && one.agent.is_some_and(only_late);
        one.code != Code::Overload && !is_late && !BY_OVERLOAD.contains(&one.code)
    });
    findings.push(Finding::of_network(Code::Overload, says, change));
}

/// Objects that are shifted by this may be taken for those of another lane, m.
const LANE_M: f64 = 2.0;

/// How far an agent's capture times are behind (s) by the objects that it shares with others; zero where they agree with as many
/// as they differ from, `None` where nothing that moves is shared. Where a pair differs, the one whose frames have taken longer is
/// behind.
fn clock_by_objects(window: &Window, agent: &AgentId) -> ClockByObjects {
    let delay = |agent: &AgentId| {
        let (least, _) = window.agents.get(agent)?.arrivals.delay()?;
        Some(least.as_secs_f64())
    };
    let (mut agree, mut differ, mut largest) = (0, 0, None::<f64>);
    let is_ahead = |one: &AgentId| delay(one).is_some_and(|delay_s| delay_s < arrivals::AHEAD.as_secs_f64());
    let mut agrees = false;
    for (pair, fit) in window.fits.iter().filter(|(pair, _)| pair.contains(agent)) {
        // Who is right has frames that arrive after they were captured.
        let other = pair[usize::from(pair[0] == *agent)];
        agrees |= matches!(fit, Fit::Agree { clocks: true }) && !is_ahead(&other);
        // Where one of both is ahead, as its frames show by themselves, the other one need not be behind.
        if pair.iter().any(is_ahead) {
            continue;
        }
        match fit {
            Fit::Agree { clocks: true } => agree += 1,
            // Where objects are shifted by a lane, too, a rest along the motion is no clock error: it is reported with the shift.
            Fit::Changed { change: Change::Rigid(Rigid { earlier_s, by_m: [x, y], .. }), .. }
                if *earlier_s != 0.0 && libm::hypot(*x, *y) < LANE_M =>
            {
                differ += 1;
                // Objects of the second agent that were there earlier are of a later time than they are said to be.
                let [first, second] = [0, 1].map(|k| delay(&pair[k]));
                let (second_is_slower, is_second) = (second > first, pair[1] == *agent);
                let behind_s = if is_second { *earlier_s } else { -*earlier_s };
                if second_is_slower == is_second && largest.is_none_or(|known| behind_s.abs() > known.abs()) {
                    largest = Some(behind_s);
                }
            }
            _ => {}
        }
    }
    ClockByObjects { behind_s: if agree > 0 && agree >= differ { Some(0.0) } else { largest }, agrees }
}

/// Agents that say themselves why they send nothing.
fn idle(around: &Surroundings<'_>) -> Vec<Finding> {
    let idle = around.tokens.idle.iter().take(MAX_AGENTS);
    idle.map(|(agent, rides_on)| {
        let says = format!("it rides on {rides_on}, which is not in the world now, and sends nothing until that is there");
        let change = "If that is not meant: `ride` in the scenario names the vehicle, `begin_s` or `from_s` when the world begins; \
                      `v2x world` shows when each vehicle is there";
        Finding::note(Code::Idle, *agent, says, change)
    })
    .collect()
}

/// Agents that are alive and send nothing.
fn silent(window: &Window) -> Vec<Finding> {
    if window.is_full() {
        return Vec::new();
    }
    let is_heard = |agent: &AgentId| {
        window.agents.get(agent).is_some_and(|one| one.arrivals.frames > 0 || !one.refused.is_empty())
    };
    let silent = window.alive.iter().filter(|agent| !is_heard(agent));
    silent
        .map(|agent| {
            Finding::fault(
                Code::Silent,
                *agent,
                "it is alive, and no detection frame of it has arrived for ten seconds or more".to_owned(),
                format!(
                    "Does it publish under `v2x/NETWORK/agent/{agent}/detections`, with its own network for NETWORK? A sensor \
                     that sees nothing sends empty frames"
                ),
            )
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_others_see_the_same_area_and_none_agrees_the_advice_on_sigma_asks_for_the_unit_first() {
        let [one, other] = ["a", "b"].map(|name| AgentId::new(name).unwrap());
        let small = || Finding::fault(Code::SigmaTooSmall, one, "too small".to_owned(), "Write more");
        let with = |fit: Fit, other_from_m: f64| {
            let mut window = Window::default();
            for (agent, from_m) in [(one, 0.0), (other, other_from_m)] {
                let extent = [(from_m, from_m + 50.0); 2];
                window.agent(agent).unwrap().writing.extent = Some(extent);
            }
            window.fits.insert([one, other], fit);
            no_accuracy_unconfirmed(&window, small())
        };
        let asked = with(Fit::Unknown, 20.0);
        assert!(
            asked.is_fault() && asked.change.contains("not pixels") && asked.change.ends_with("Write more")
        );
        assert_eq!(with(Fit::Agree { clocks: false }, 20.0), small());
        assert_eq!(with(Fit::Unknown, 200.0), small(), "of another area");
    }

    #[test]
    fn that_there_are_no_places_for_more_errors_is_a_note_and_that_all_have_one_is_none() {
        let agents: Vec<_> = (0..9).map(|n| AgentId::new(&format!("a{n}")).unwrap()).collect();
        let note = unregistered(&agents).unwrap();
        assert!(!note.is_fault() && note.code == Code::RegistrationFull, "{note}");
        assert!(note.says.contains("of 9 agents (a0, ") && note.says.contains("a7, …)"), "{note}");
        assert_eq!(unregistered(&[]), None);
    }

    #[test]
    fn what_stands_and_nobody_else_sees_is_no_proof_of_accuracy() {
        let [one, other] = ["a", "b"].map(|name| AgentId::new(name).unwrap());
        let large = || Finding::fault(Code::SigmaTooLarge, one, "too large".to_owned(), "Write less");
        let small = || Finding::fault(Code::SigmaTooSmall, one, "too small".to_owned(), "Write more");
        let mut window = Window::default();
        let note = no_accuracy_of_repetition(&window, large());
        assert!(!note.is_fault() && note.change.contains("nobody else sees it"), "{note}");
        assert!(note.change.ends_with("Write less"), "{note}");
        assert!(no_accuracy_of_repetition(&window, small()).is_fault());
        window.fits.insert([one, other], Fit::Unknown);
        assert!(!no_accuracy_of_repetition(&window, large()).is_fault());
        window.fits.insert([one, other], Fit::Agree { clocks: false });
        assert_eq!(no_accuracy_of_repetition(&window, large()), large());
    }
}
