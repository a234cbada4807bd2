//! Listens, asks the hubs, and reports.

use super::CheckArgs;
use super::listener::Listener;
use super::unserved;
use crate::health;
use crate::output;
use crate::served::{self, Served};
use anyhow::Context;
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::PoisonError;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::clock;
use v2x_common::id::{AgentId, HubId, NetworkId};
use v2x_common::net::session;
use v2x_common::time::{Span, Timestamp};
use v2x_fusion_hub::diagnosis::{Code, Finding, Transport};
use v2x_fusion_hub::hub::{AgentStatus, HubStatus, Verdict};
use zenoh::Session;

/// What a hub has judged is of the time of listening where it began no earlier than this before.
const SAME_TIME: Span = Span::from_millis(5_000);
/// Longest time that a hub takes until then: twice ten seconds, and half a second for each pair of agents.
const HUB_JUDGES_WITHIN: Span = Span::from_millis(32_000);
/// Exit codes.
const DEGRADED: u8 = 1;
const NOBODY: u8 = 3;

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    network: NetworkId,
    /// The hubs that say what they found; without one, the findings are those of this program.
    hubs: Vec<&'a HubStatus>,
    /// Of the agents that this program heard.
    heard: Vec<(AgentId, Transport)>,
    verdict: Verdict,
    findings: &'a [Finding],
}

/// Listens, and says what looks wrong; the exit code says whether anything is.
pub(crate) async fn run(args: &CheckArgs, shutdown: &CancellationToken) -> anyhow::Result<ExitCode> {
    let (settings, duration) = (args.settings()?, args.duration()?);
    // Interrupted before anything was heard: that is no healthy network.
    let Some(session) = open(args, shutdown).await? else { return Ok(ExitCode::from(NOBODY)) };
    let mut listener = Listener::new(settings, args.network);
    let began_at = clock::now();
    say(&format!("listening to network {} for {:.0} s ...", args.network, duration.as_secs_f64()));
    listener.listen(&session, args.network, duration, shutdown).await?;
    let mut served = Served::of(&session).await;
    let strays = listener.strays.lock().unwrap_or_else(PoisonError::into_inner).clone();
    served.merge(&strays.hubs);
    let asked_at = clock::now();
    let hubs = Hubs { network: args.network, hub: args.hub, served: &served, began_at };
    let statuses = ask(&session, &hubs, shutdown).await;
    // A hub that was heard may have ended since.
    let alive = Served::of(&session).await;
    session::close(session).await?;
    let statuses = statuses?;
    let mut findings = strays.findings(&served.networks());
    if statuses.is_empty() {
        let asked = unserved::Asked {
            network: args.network,
            hub: args.hub,
            stands_in: !args.listen.is_empty(),
            is_alive: alive.has(args.network, args.hub),
            waited: clock::now() - asked_at,
        };
        findings.extend(unserved::finding(&asked, &served, listener.frames));
        findings.extend(listener.core.findings().iter().cloned());
    }
    // What is published beside the expected keys is heard by both.
    let is_heard = findings.iter().any(|one| one.code == Code::WrongKey);
    let of_hubs = statuses.iter().flat_map(|status| status.findings.iter().cloned());
    findings
        .extend(of_hubs.filter(|one| !(is_heard && one.code == Code::WrongKey)).map(without_this_command));
    findings.extend(statuses.iter().filter_map(|status| outdated(status, began_at)));
    findings.extend(statuses.iter().filter_map(without_objects));
    // A hub that hears nobody is explained by those who publish elsewhere; and it names invalid names itself.
    let is_explained = |one: &Finding| {
        one.code == Code::NoAgents
            && findings
                .iter()
                .any(|other| matches!(other.code, Code::WrongKey | Code::WrongNetwork | Code::InvalidName))
    };
    let mut findings: Vec<_> = findings.iter().filter(|one| !is_explained(one)).cloned().collect();
    findings.extend(missing_agent(args, &statuses, &listener));
    findings.sort_by_key(|one| one.severity);
    let findings = health::of_agent(&findings, args.agent);
    report(args, &statuses, &listener, &findings)?;
    Ok(match Verdict::of(&findings) {
        _ if statuses.is_empty() && listener.frames == 0 && findings.is_empty() => ExitCode::from(NOBODY),
        Verdict::Healthy => ExitCode::SUCCESS,
        Verdict::Degraded => ExitCode::from(DEGRADED),
    })
}

async fn open(args: &CheckArgs, shutdown: &CancellationToken) -> anyhow::Result<Option<Session>> {
    let options = args.session();
    if !args.listen.is_empty() {
        let opened = session::open(session::hub_config(&options)?).await;
        let session = opened.with_context(|| format!("cannot listen on {}", args.listen.join(", ")))?;
        say(&format!("in place of a hub at {}", session::locators(&session).await.join(" ")));
        return Ok(Some(session));
    }
    let opened = session::open_patiently(session::client_config(&options)?, Some(args.wait()?), shutdown);
    opened.await.context(
        "start a hub, give --connect, or let this command stand in for one: v2x check --listen tcp/127.0.0.1:7447",
    )
}

/// The hubs that are asked.
struct Hubs<'a> {
    network: NetworkId,
    /// One of them alone.
    hub: Option<HubId>,
    /// Those that are there.
    served: &'a Served,
    began_at: Timestamp,
}

/// The statuses of the hubs, once those have judged ten seconds of about this time: a hub judges ten seconds at a time.
async fn ask(
    session: &Session,
    hubs: &Hubs<'_>,
    shutdown: &CancellationToken,
) -> anyhow::Result<Vec<HubStatus>> {
    let mut has_said = false;
    let first_asked_at = clock::now();
    loop {
        let statuses = served::statuses(session, (hubs.network, hubs.hub), hubs.served, false).await?;
        let is_late = clock::now() - first_asked_at >= HUB_JUDGES_WITHIN;
        if statuses.iter().all(|status| is_new(status, hubs.began_at)) || is_late || shutdown.is_cancelled() {
            return Ok(statuses);
        }
        if !has_said {
            say("the hub judges ten seconds at a time: some seconds more ...");
            has_said = true;
        }
        tokio::select! {
            () = shutdown.cancelled() => {}
            () = tokio::time::sleep(Duration::from_millis(500)) => {}
        }
    }
}

/// Whether the hub has judged ten seconds of about this time.
fn is_new(status: &HubStatus, began_at: Timestamp) -> bool {
    status.judged_since.is_some_and(|since| since >= (began_at - SAME_TIME).as_micros())
}

#[expect(clippy::cast_precision_loss, reason = "for people")]
fn seconds(micros: i64) -> f64 {
    micros as f64 * 1e-6
}

/// What a hub says is of a time before this command, or of no whole ten seconds yet.
fn outdated(status: &HubStatus, began_at: Timestamp) -> Option<Finding> {
    if is_new(status, began_at) {
        return None;
    }
    let hub = status.hub;
    let says = match status.judged_since {
        Some(since) => format!(
            "what hub {hub} says is of ten seconds that began {:.0} s before this command: it has judged none since",
            seconds((began_at.as_micros() - since).max(0))
        ),
        None => format!("hub {hub} has not judged whole ten seconds yet: what it says is of less"),
    };
    let change = "Ask again in a minute; a hub that has no time for its frames judges late, too";
    Some(Finding::of_network(Code::Outdated, says, change).as_note())
}

/// Without the advice to do what this command has just done.
fn without_this_command(finding: Finding) -> Finding {
    let is_of_others = |sentence: &&str| !sentence.starts_with("`v2x check`");
    let change: Vec<_> = finding.change.split_inclusive("? ").filter(is_of_others).collect();
    Finding { change: change.concat().trim_end().to_owned(), ..finding }
}

/// A hub that knows agents, and has no object to publish.
fn without_objects(status: &HubStatus) -> Option<Finding> {
    /// Objects are gone by then whose agents send nothing any more.
    const SILENT_S: f64 = 2.0;
    let is_said = status.findings.iter().any(|one| matches!(one.code, Code::NoAgents | Code::NothingFused));
    let newest = status.agents.iter().filter_map(|agent| agent.newest_captured_at).max()?;
    if is_said || status.objects > 0 {
        return None;
    }
    let age_s = seconds(status.now - newest);
    let says = match age_s > SILENT_S {
        true => format!("hub {} has no object: the newest frame was captured {age_s:.0} s ago", status.hub),
        false => format!("hub {} has no object, though frames come", status.hub),
    };
    let change = match age_s > SILENT_S {
        true => "Has the replay, or the agents' program, ended? What is said above is of the time before",
        false => "Do the agents see anything? An object is published once several detections confirm it",
    };
    Some(Finding::of_network(Code::NoAgents, says, change).as_note())
}

/// The agent that was asked for, where nobody has heard of it.
fn missing_agent(args: &CheckArgs, statuses: &[HubStatus], listener: &Listener) -> Option<Finding> {
    let agent = args.agent?;
    let is_known = statuses.iter().flat_map(|status| &status.agents).any(|one| one.id == agent)
        || listener.core.engine().agents().record(&agent).is_some()
        // Its hub says more of it.
        || statuses.iter().flat_map(|status| &status.findings).any(|one| one.agent == Some(agent));
    (!is_known).then(|| {
        let known: Vec<_> =
            statuses.iter().flat_map(|status| &status.agents).map(|one| one.id.to_string()).collect();
        let known = if known.is_empty() { String::new() } else { format!(" (known: {})", known.join(", ")) };
        let says = format!("agent {agent} is not known in network {}{known}", args.network);
        let change = format!(
            "It publishes under `v2x/{}/agent/{agent}/detections`; does it run, and does it connect here?",
            args.network
        );
        Finding::of_network(Code::Silent, says, change)
    })
}

fn report(
    args: &CheckArgs,
    statuses: &[HubStatus],
    listener: &Listener,
    findings: &[Finding],
) -> anyhow::Result<()> {
    let known: Vec<_> = listener.core.engine().agents().iter().map(|(agent, _)| *agent).collect();
    let heard = known.iter().filter_map(|agent| Some((*agent, listener.core.survey().transport(agent)?)));
    let heard: Vec<_> = heard.filter(|(agent, _)| args.agent.is_none_or(|one| one == *agent)).collect();
    if args.json {
        let hubs = statuses.iter().collect();
        let report = Report { network: args.network, hubs, heard, verdict: Verdict::of(findings), findings };
        output::print(&(serde_json::to_string_pretty(&report)? + "\n"))?;
        return Ok(());
    }
    let mut text = String::new();
    for status in statuses {
        let is_asked = |agent: &&AgentStatus| args.agent.is_none_or(|one| one == agent.id);
        let agents: Vec<_> = status.agents.iter().filter(is_asked).collect();
        text.push_str(&format!("{}\n\n{}\n", health::hub_line(status), health::agent_table(&agents)));
    }
    if statuses.is_empty() {
        text.push_str(&format!(
            "no hub answers in network {}; {} frames were heard, and are judged as a hub would\n\n",
            args.network, listener.frames
        ));
        for (agent, Transport { rate_hz, delay_ms, jitter_ms, .. }) in &heard {
            text.push_str(&format!(
                "{agent}: {rate_hz:.1} Hz, delay {} ms, jitter {} ms\n",
                health::time(Some(*delay_ms)),
                health::time(Some(*jitter_ms))
            ));
        }
        if !heard.is_empty() {
            text.push('\n');
        }
    }
    text.push_str(&health::findings_text(findings));
    let nobody = statuses.is_empty() && listener.frames == 0 && findings.is_empty();
    let verdict = match nobody {
        true => "nothing to judge: no hub and no frame".to_owned(),
        false => health::verdict_line(findings),
    };
    if !findings.is_empty() {
        text.push('\n');
    }
    output::print(&format!("{text}{verdict}\n"))?;
    Ok(())
}

/// Progress, on standard error of a terminal.
fn say(line: &str) {
    let mut err = std::io::stderr().lock();
    if err.is_terminal() {
        // A closed standard error is no fault of the check.
        let _ = writeln!(err, "{line}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    /// A hub whose only agent's newest frame was captured so many seconds ago.
    fn status(objects: u32, age_s: i64, more: &Value) -> HubStatus {
        let quantiles = json!({ "p50": null, "p95": null, "p99": null, "max": null, "count": 0 });
        let agent = json!({
            "id": "cam1", "alive": true, "accepted": 9, "synchronous": 0, "out_of_sequence": 0, "ahead_of_time": 0,
            "refused": {}, "last_refusal": null, "unmapped_classes": 0, "descriptions_refused": 0, "nis_per_dof": null,
            "newest_captured_at": 100_000_000 - age_s * 1_000_000, "sensor": null,
        });
        let mut status = json!({
            "hub": "hub", "network": "demo", "version": "0", "lineage": 1, "started_at": 0, "now": 100_000_000, "locators": [],
            "tracks": 0, "objects": objects, "frames_published": 0, "publish_errors": 0, "dropped_overload": 0,
            "refused_beyond_limit": 0, "refused_unnamed": 0, "births_refused": 0, "merges": 0, "objects_withheld": 0,
            "invalid_names": [], "latency_ms": quantiles, "compute_ms": quantiles, "memory_bytes": null, "agents": [agent],
        });
        for (key, value) in more.as_object().into_iter().flatten() {
            status[key] = value.clone();
        }
        serde_json::from_value(status).unwrap()
    }

    #[test]
    fn a_hub_without_objects_after_its_agents_have_ended_is_not_passed_over() {
        let none = json!({});
        let note = without_objects(&status(0, 7, &none)).unwrap();
        assert!(!note.is_fault() && note.says.contains("captured 7 s ago"), "{note}");
        assert!(without_objects(&status(0, 0, &none)).unwrap().says.contains("though frames come"));
        assert_eq!(without_objects(&status(3, 7, &none)), None);
        let said = json!({ "findings": [Finding::of_network(Code::NoAgents, "none", "")] });
        assert_eq!(without_objects(&status(0, 7, &said)), None, "the hub says it itself");
    }

    #[test]
    fn what_a_hub_says_is_repeated_without_the_advice_to_check() {
        let change = "Do agents use its endpoint? `v2x check` listens beside the expected keys";
        let said = without_this_command(Finding::of_network(Code::NoAgents, "none", change));
        assert_eq!(said.change, "Do agents use its endpoint?");
        let other = Finding::of_network(Code::NoAgents, "none", "Is it on? Start it");
        assert_eq!(without_this_command(other.clone()), other);
    }

    #[test]
    fn findings_of_an_earlier_time_are_said_to_be_of_it() {
        let began_at = Timestamp::EPOCH + Span::from_millis(100_000);
        let since = |s: i64| json!({ "judged_since": s * 1_000_000 });
        assert_eq!(outdated(&status(1, 0, &since(96)), began_at), None);
        let note = outdated(&status(1, 0, &since(60)), began_at).unwrap();
        assert!(!note.is_fault() && note.says.contains("began 40 s before this command"), "{note}");
        let note = outdated(&status(1, 0, &json!({})), began_at).unwrap();
        assert!(note.says.contains("has not judged whole ten seconds"), "{note}");
    }
}
