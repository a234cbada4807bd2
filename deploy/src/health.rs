//! A hub's status for people: its agents as a table, and what is found in sentences.

use std::fmt::Write;
use v2x_common::id::AgentId;
use v2x_fusion_hub::diagnosis::{Finding, Severity};
use v2x_fusion_hub::hub::{AgentStatus, HubStatus, StandbyStatus, Verdict};

/// The hub in two lines.
pub(crate) fn hub_line(status: &HubStatus) -> String {
    let alive = status.agents.iter().filter(|agent| agent.alive).count();
    let up_s = (status.now - status.started_at) / 1_000_000;
    let latency =
        status.latency_ms.p50.map(|p50| format!(", latency {p50:.1} ms (median)")).unwrap_or_default();
    let standby = status.standby.as_ref().map(|standby| format!("{}\n", standby_line(standby, status.now)));
    format!(
        "network {}, hub {} at {}, up {}\n{}{alive} of {} agents alive, {} objects{latency}",
        status.network,
        status.hub,
        status.locators.join(" "),
        seconds(up_s),
        standby.unwrap_or_default(),
        status.agents.len(),
        status.objects
    )
}

/// Which of two hubs of a name it is.
fn standby_line(standby: &StandbyStatus, now: i64) -> String {
    let StandbyStatus { publishes, follows, heard_at, .. } = standby;
    let heard_ms = heard_at.map(|at| (now - at) / 1000);
    match (publishes, follows, heard_ms) {
        (true, ..) => "publishes; another hub may stand by for it".to_owned(),
        (false, Some(lineage), Some(ms)) => {
            format!(
                "stands by for hub {lineage:08x}, heard {ms} ms ago; {} ids of it",
                standby.named_by_another
            )
        }
        _ => "stands by, and hears no other hub".to_owned(),
    }
}

fn seconds(seconds: i64) -> String {
    match seconds {
        ..=119 => format!("{seconds} s"),
        120..=7199 => format!("{} min", seconds / 60),
        _ => format!("{} h", seconds / 3600),
    }
}

/// The agents as a table of at most 80 columns; names that are longer than usual widen it.
pub(crate) fn agent_table(agents: &[&AgentStatus]) -> String {
    let width = agents.iter().map(|agent| agent.id.as_str().len()).max().unwrap_or(0).max(5);
    let mut text = format!(
        "{:width$}  alive  {:>5}  {:>8}  {:>9}  {:>7}  {:>8}  {:>7}  {:>5}\n",
        "agent", "Hz", "delay ms", "jitter ms", "missing", "accepted", "refused", "NIS"
    );
    for agent in agents {
        let transport = agent.transport.as_ref();
        let number = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
        };
        let missing = transport.and_then(|one| one.missing).map(|share| format!("{:.1} %", 100.0 * share));
        // Writing to a text cannot fail.
        let _ = writeln!(
            text,
            "{:width$}  {:5}  {:>5}  {:>8}  {:>9}  {:>7}  {:>8}  {:>7}  {:>5}",
            agent.id.as_str(),
            match (&agent.idle, agent.alive) {
                (Some(_), true) => "idle",
                (_, true) => "yes",
                (_, false) => "no",
            },
            number(transport.map(|one| one.rate_hz), 1),
            time(transport.map(|one| one.delay_ms)),
            time(transport.map(|one| one.jitter_ms)),
            missing.unwrap_or_else(|| "-".to_owned()),
            agent.accepted,
            agent.refused.values().sum::<u64>(),
            number(agent.nis_per_dof, 2)
        );
    }
    text
}

/// Milliseconds in a narrow column: what is far beyond them is of a stamp in another unit, and no figure.
pub(crate) fn time(ms: Option<f64>) -> String {
    match ms {
        None => "-".to_owned(),
        Some(ms) if ms.abs() < 1e5 => format!("{ms:.0}"),
        Some(ms) if ms.abs() < 3.6e6 => format!("{:.0} s", ms / 1e3),
        Some(ms) if ms < 0.0 => "< -1 h".to_owned(),
        Some(_) => "> 1 h".to_owned(),
    }
}

/// The findings of one agent, or all of them, a paragraph each.
pub(crate) fn findings_text(findings: &[Finding]) -> String {
    let mut text = String::new();
    for finding in findings {
        let word = if finding.severity == Severity::Fault { "FAULT" } else { "note " };
        text.push_str(&wrapped(&format!("{word}  {finding}"), 7));
    }
    text
}

/// All in all, in one line.
pub(crate) fn verdict_line(findings: &[Finding]) -> String {
    let faults = findings.iter().filter(|one| one.is_fault()).count();
    let notes = findings.len() - faults;
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    match Verdict::of(findings) {
        Verdict::Healthy if notes == 0 => "healthy: nothing looks wrong".to_owned(),
        Verdict::Healthy => format!("healthy: {}", count(notes, "note")),
        Verdict::Degraded => format!("degraded: {}, {}", count(faults, "fault"), count(notes, "note")),
    }
}

/// What concerns an agent: its own, those of the network, and those that name it.
pub(crate) fn of_agent(findings: &[Finding], agent: Option<AgentId>) -> Vec<Finding> {
    let Some(agent) = agent else { return findings.to_vec() };
    let concerns = |one: &&Finding| {
        let is_named =
            one.says.split(|c: char| c.is_whitespace() || c == ',').any(|word| word == agent.as_str());
        one.agent == Some(agent) || (one.agent.is_none() && (is_named || one.code.is_of_network()))
    };
    findings.iter().filter(concerns).cloned().collect()
}

/// Broken at spaces to 80 columns; further lines are indented.
fn wrapped(text: &str, indent: usize) -> String {
    const COLUMNS: usize = 80;
    let (mut lines, mut line) = (String::new(), String::new());
    for word in text.split(' ') {
        let length = line.chars().count() + 1 + word.chars().count();
        if length > COLUMNS && !line.trim().is_empty() {
            lines.push_str(line.trim_end());
            lines.push('\n');
            line = " ".repeat(indent) + word;
        } else {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines + line.trim_end() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_fusion_hub::diagnosis::Code;

    fn finding(code: Code, agent: Option<&str>, says: &str) -> Finding {
        let agent = agent.map(|name| AgentId::new(name).unwrap());
        Finding { code, severity: Severity::Fault, agent, says: says.into(), change: "Change it".into() }
    }

    #[test]
    fn times_that_are_no_delay_do_not_widen_their_column() {
        let cells = [None, Some(23.4), Some(-120_000.0), Some(1.79e12), Some(-1.79e12)].map(time);
        assert_eq!(cells, ["-", "23", "-120 s", "> 1 h", "< -1 h"]);
    }

    #[test]
    fn sentences_fit_eighty_columns_and_keep_their_words() {
        let long =
            finding(Code::Degrees, Some("cam1"), &"its headings are degrees and not radians, ".repeat(5));
        let text = findings_text(&[long]);
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        assert!(text.starts_with("FAULT  cam1: its headings") && text.lines().count() > 2, "{text}");
        assert!(text.lines().skip(1).all(|line| line.starts_with("       ")), "{text}");
    }

    #[test]
    fn an_agents_own_findings_are_those_that_name_it_and_those_of_the_network() {
        let all = [
            finding(Code::Degrees, Some("a"), "degrees"),
            finding(Code::Degrees, Some("b"), "degrees"),
            finding(Code::Offset, None, "the objects of a lie 2 m east of those of b"),
            finding(Code::Offset, None, "the objects of c lie 2 m east of those of b"),
            finding(Code::WrongKey, None, "something publishes"),
        ];
        let of_a = of_agent(&all, AgentId::new("a").ok());
        assert_eq!(of_a, [all[0].clone(), all[2].clone(), all[4].clone()]);
        assert_eq!(of_agent(&all, None).len(), all.len());
        assert_eq!(verdict_line(&all[..1]), "degraded: 1 fault, 0 notes");
        assert_eq!(verdict_line(&[]), "healthy: nothing looks wrong");
    }
}
