//! `v2x status`: the status of the hubs of a network.

use crate::output;
use anyhow::{Context, bail};
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::id::NetworkId;
use v2x_common::net::session::{self, SessionOptions};
use v2x_fusion_hub::hub::{HubStatus, InvalidName, RegistrationStatus};

#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "\
Examples:
  v2x status
  v2x status --connect tcp/192.168.1.10:7447 | jq '.agents[] | {id, accepted, refused}'")]
pub(crate) struct StatusArgs {
    /// The network of the hubs
    #[arg(long, default_value = "demo")]
    network: NetworkId,
    /// The hub or router to connect to; may be given more than once [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,
    /// A Zenoh configuration file that replaces our defaults
    #[arg(long, value_name = "FILE")]
    zenoh_config: Option<PathBuf>,
    /// Seconds to wait for a hub
    #[arg(long, default_value_t = 5.0, value_name = "SECONDS")]
    wait: f64,
}

/// Prints each hub's status as JSON, and on standard error in words what is wrong with agents: errors of clocks and poses,
/// names, dropped detections, unknown classes, refusals.
pub(crate) async fn run(args: &StatusArgs, shutdown: &CancellationToken) -> anyhow::Result<()> {
    let options = SessionOptions {
        config: args.zenoh_config.clone(),
        connect: args.connect.clone(),
        listen: Vec::new(),
    };
    let timeout = Duration::try_from_secs_f64(args.wait).context("--wait is no number of seconds")?;
    let opened = session::open_patiently(session::client_config(&options)?, Some(timeout), shutdown);
    let Some(session) = opened.await.context("start a hub with `v2x up crossing`, or give --connect")? else {
        return Ok(());
    };
    let statuses = v2x_lab::loopback::hub_status::query(&session, args.network).await;
    session::close(session).await?;
    let statuses = statuses?;
    if statuses.is_empty() {
        bail!("no hub of network {} answered; is --network right?", args.network);
    }
    for status in statuses {
        let json = serde_json::to_string_pretty(&status)? + "\n";
        if output::print(&json)? == output::Output::Closed {
            break;
        }
        print_remarks(&status);
    }
    Ok(())
}

/// On standard error: standard output is JSON alone.
fn print_remarks(status: &HubStatus) {
    let mut err = std::io::stderr().lock();
    for line in remarks(status) {
        // A closed standard error is no fault of the status.
        let _ = writeln!(err, "{line}");
    }
}

/// What somebody should know of the agents, in words.
fn remarks(status: &HubStatus) -> Vec<String> {
    let mut lines = Vec::new();
    for InvalidName { name, reason, samples } in &status.invalid_names {
        lines.push(format!("agent {name:?}: nothing of it is used ({samples} samples): {reason}"));
    }
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
        if let Some(learnt) =
            agent.learnt.as_ref().filter(|learnt| learnt.is_remarkable(agent.sensor.is_some()))
        {
            let declared = agent.sensor.map(|sensor| sensor.detection_probability);
            lines.push(format!("{id}: its sensor {}", learnt.in_words(declared)));
        }
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
            "latency_ms": quantiles, "compute_ms": quantiles, "memory_bytes": null, "agents": [agent],
        });
        let lines = remarks(&serde_json::from_value(status).unwrap());
        assert_eq!(
            lines,
            [
                "agent \"cam/north\": nothing of it is used (1 samples): it holds '/'",
                "carla: impossible detections dropped (w out of range 7); the newest: w of detection 2 is 0",
                "carla: 2 detections of unknown classes (ufo 2)",
                "carla: every frame is refused; the newest: captured long ago",
            ]
        );
    }
}
