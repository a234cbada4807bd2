//! `v2x status`: the status of the hubs of a network.

use crate::health;
use crate::output;
use crate::served::{self, Served};
use anyhow::{Context, bail};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::duration::parse_seconds;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::net::endpoint_given::to_connect;
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::net::zenoh_refusals::Denied;
use v2x_fusion_hub::hub::{AgentStatus, HubStatus, InvalidName, RegistrationStatus, Verdict};

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x status                      the hub, its agents, and what looks wrong
  v2x status --json | jq '.agents[] | {id, accepted, refused}'
  v2x status --check              one verdict, for scripts and monitoring

Exit code: 0; with --check 0 healthy, 1 degraded, 3 no hub.")]
pub(crate) struct StatusArgs {
    /// The network of the hubs
    #[arg(long, default_value = "demo")]
    network: NetworkId,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", value_parser = to_connect)]
    connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,
    /// The status of this hub alone [default: every hub's]
    #[arg(long, value_name = "NAME")]
    hub: Option<HubId>,
    /// How long to wait for a hub
    #[arg(long, default_value = "5s", value_name = "DURATION", value_parser = parse_seconds)]
    wait: f64,
    /// Print JSON: everything that the hub says of itself
    #[arg(long, conflicts_with = "check")]
    json: bool,
    /// Print the verdict and its reasons alone; the exit code says which
    #[arg(long)]
    check: bool,
}

/// A hub that is there says nothing.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct NoAnswer(String);

/// Exit codes of `--check`.
const DEGRADED: u8 = 1;
const NO_HUB: u8 = 3;

/// Prints the status of each hub: a table and what looks wrong, or JSON.
///
/// JSON has on standard error in words what is known of the agents: errors of clocks and poses, names, dropped detections,
/// unknown classes, refusals.
pub(crate) async fn run(args: &StatusArgs, shutdown: &CancellationToken) -> anyhow::Result<ExitCode> {
    let statuses = match ask(args, shutdown).await {
        Ok(Some(statuses)) => statuses,
        // Interrupted before a hub answered: that is no healthy network.
        Ok(None) => return Ok(if args.check { ExitCode::from(NO_HUB) } else { ExitCode::SUCCESS }),
        Err(error) if args.check && error.is::<NoAnswer>() => {
            output::print(&format!("degraded: {error}\n"))?;
            return Ok(ExitCode::from(DEGRADED));
        }
        Err(error) if args.check => {
            output::print(&format!("no hub: {error:#}\n"))?;
            return Ok(ExitCode::from(NO_HUB));
        }
        Err(error) => return Err(error),
    };
    for status in &statuses {
        let text =
            if args.json { serde_json::to_string_pretty(status)? + "\n" } else { text(status, args.check) };
        if output::print(&text)? == output::Output::Closed {
            break;
        }
        if args.json {
            print_remarks(status);
        }
    }
    let is_degraded = statuses.iter().any(|status| status.verdict == Verdict::Degraded);
    Ok(if args.check && is_degraded { ExitCode::from(DEGRADED) } else { ExitCode::SUCCESS })
}

/// The statuses; `None` where shutdown was requested.
async fn ask(args: &StatusArgs, shutdown: &CancellationToken) -> anyhow::Result<Option<Vec<HubStatus>>> {
    let options = SessionOptions {
        config: args.zenoh_config.clone(),
        connect: args.connect.clone(),
        listen: Vec::new(),
    };
    let timeout = Duration::try_from_secs_f64(args.wait).context("--wait is no number of seconds")?;
    let opened = session::open_patiently(session::client_config(&options)?, Some(timeout), shutdown);
    let Some(session) = opened.await.context("start a hub with `v2x up crossing`, or give --connect")? else {
        return Ok(None);
    };
    let served = Served::of(&session).await;
    let statuses = served::statuses(&session, (args.network, args.hub), &served, true).await;
    session::close(session).await?;
    let statuses = statuses?;
    if statuses.is_empty() && served.has(args.network, args.hub) {
        return Err(anyhow::Error::new(NoAnswer(format!(
            "{} of network {} is there and does not answer: it is overloaded, or this program may not ask it",
            served.names(args.network),
            args.network
        ))));
    }
    if statuses.is_empty() {
        let who = args.hub.map_or_else(|| "no hub".to_owned(), |hub| format!("no hub {hub}"));
        bail!("{who} of network {} answered; is --network right?", args.network);
    }
    Ok(Some(statuses))
}

/// For people: the hub, its agents, what looks wrong; or the verdict with its reasons alone.
fn text(status: &HubStatus, is_brief: bool) -> String {
    let verdict = health::verdict_line(&status.findings);
    let findings = health::findings_text(&status.findings);
    if is_brief {
        return format!("{} {verdict}\n{findings}", status.hub);
    }
    let agents: Vec<_> = status.agents.iter().collect();
    let learnt = agents.iter().filter_map(|agent| learnt_line(agent)).collect::<String>();
    let table = health::agent_table(&agents);
    let refused = refusal_lines(status).iter().map(|line| format!("{line}\n")).collect::<String>();
    let parts = [health::hub_line(status) + "\n", table, learnt, refused, findings, verdict + "\n"];
    let parts: Vec<_> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join("\n")
}

/// On standard error: standard output is JSON alone.
fn print_remarks(status: &HubStatus) {
    let mut err = std::io::stderr().lock();
    for line in remarks(status) {
        // A closed standard error is no fault of the status.
        let _ = writeln!(err, "{line}");
    }
}

/// What Zenoh has refused: handshakes by cause, and who was denied what.
fn refusal_lines(status: &HubStatus) -> Vec<String> {
    let denied = status.refused_by_zenoh.denied.iter();
    let denied = denied.map(|Denied { who, action, key, count }| {
        let times = if *count == 1 { "once".to_owned() } else { format!("{count} times") };
        format!("denied to {who}: {action} {key} ({times})")
    });
    status.refused_by_zenoh.in_words().into_iter().chain(denied).collect()
}

/// What is learnt of a sensor, where it is not as a good one is or as it declares.
fn learnt_line(agent: &AgentStatus) -> Option<String> {
    let learnt = agent.learnt.as_ref().filter(|learnt| learnt.is_remarkable(agent.sensor.is_some()))?;
    Some(format!("{}: its sensor {}\n", agent.id, learnt.in_words(agent.sensor.as_ref())))
}

/// What somebody should know of the agents, in words.
fn remarks(status: &HubStatus) -> Vec<String> {
    let mut lines = Vec::new();
    for InvalidName { name, reason, samples } in &status.invalid_names {
        lines.push(format!("agent {name:?}: nothing of it is used ({samples} samples): {reason}"));
    }
    lines.extend(refusal_lines(status));
    for agent in &status.agents {
        let id = agent.id;
        lines.extend(
            agent
                .registration
                .as_ref()
                .and_then(RegistrationStatus::in_words)
                .map(|words| format!("{id}: {words}")),
        );
        if let Some(last) = &agent.last_dropped {
            let causes: Vec<_> =
                agent.dropped_detections.iter().map(|(cause, count)| format!("{cause} {count}")).collect();
            let causes = causes.join(", ");
            lines.push(format!("{id}: impossible detections dropped ({causes}); the newest: {last}"));
        }
        if agent.unmapped_classes > 0 {
            let names: Vec<_> =
                agent.unmapped_names.iter().map(|(name, count)| format!("{name} {count}")).collect();
            let (count, names) = (agent.unmapped_classes, names.join(", "));
            lines.push(format!("{id}: {count} detections of unknown classes ({names})"));
        }
        lines.extend(learnt_line(agent).map(|line| line.trim_end().to_owned()));
        if let (0, Some(refusal)) = (agent.accepted, &agent.last_refusal) {
            lines.push(format!("{id}: every frame is refused; the newest: {refusal}"));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_agents_is_said_in_words() {
        let quantiles = serde_json::json!({ "p50": null, "p95": null, "p99": null, "max": null, "count": 0 });
        let agent = serde_json::json!({
            "id": "carla", "alive": true, "accepted": 0, "synchronous": 0, "out_of_sequence": 0, "ahead_of_time": 0, "clock_set_back": 0,
            "refused": { "too_late": 3 }, "last_refusal": "captured long ago", "dropped_detections": { "w out of range": 7 },
            "last_dropped": "w of detection 2 is 0", "unmapped_classes": 2, "unmapped_names": { "ufo": 2 },
            "descriptions_refused": 0, "nis_per_dof": null, "newest_captured_at": null, "sensor": null,
        });
        let status = serde_json::json!({
            "hub": "hub", "network": "demo", "version": "0", "lineage": 1, "started_at": 0, "now": 0, "locators": [],
            "tracks": 0, "objects": 0, "frames_published": 0, "publish_errors": 0, "dropped_overload": 0,
            "refused_beyond_limit": 0, "refused_unnamed": 1, "births_refused": 0, "merges": 0, "objects_withheld": 0,
            "invalid_names": [{ "name": "cam/north", "reason": "it holds '/'", "samples": 1 }],
            "refused_by_zenoh": { "handshakes": { "expired": 2 }, "messages": 5, "denied": [
                { "who": "agent:eve", "action": "Put", "key": "v2x/demo/agent/ego/detections", "count": 5 },
            ] },
            "latency_ms": quantiles, "compute_ms": quantiles, "memory_bytes": null, "agents": [agent],
        });
        let lines = remarks(&serde_json::from_value(status).unwrap());
        assert_eq!(
            lines,
            [
                "agent \"cam/north\": nothing of it is used (1 samples): it holds '/'",
                "TLS handshakes refused: expired 2; messages denied by the access control: 5",
                "denied to agent:eve: Put v2x/demo/agent/ego/detections (5 times)",
                "carla: impossible detections dropped (w out of range 7); the newest: w of detection 2 is 0",
                "carla: 2 detections of unknown classes (ufo 2)",
                "carla: every frame is refused; the newest: captured long ago",
            ]
        );
    }
}
