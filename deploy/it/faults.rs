//! Faults of single processes, beside which the others go on.

use crate::support::{TIMEOUT, V2x, folder, run, send};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::path::Path;

/// Lists that a reader gets meanwhile: more bytes than sockets and queues hold for one who does not read.
const MEANWHILE: usize = 300;
/// The longest time between two lists, µs; a machine may be busy.
const LONGEST_GAP_US: i64 = 2_000_000;

#[tokio::test(flavor = "multi_thread")]
async fn a_consumer_that_stops_is_a_fault_that_costs_no_other_consumer_a_list() -> anyhow::Result<()> {
    let folder = folder("fault-consumer")?;
    let args =
        ["up", "crossing", "--listen", "tcp/127.0.0.1:0", "--network", "fault-consumer", "--out", "run"];
    let mut up = V2x::start(&folder, &args)?;
    let line = up.stderr_line("watch it with").await?;
    let locator = line.split("--connect ").nth(1).context("an endpoint")?.trim().to_owned();
    let watch = ["watch", "--json", "--network", "fault-consumer", "--connect", &locator];
    let mut stopped = V2x::start(&folder, &watch)?;
    stopped.line().await?;
    send("STOP", stopped.process_id()?).await?;
    let count = MEANWHILE.to_string();
    let ending = run(&folder, &[&watch[..], &["--count", &count]].concat()).await?;
    ensure!(ending.code == Some(0), "{ending:?}");
    let lists: Vec<Value> = ending.stdout.lines().map(serde_json::from_str).collect::<Result<_, _>>()?;
    ensure!(lists.len() == MEANWHILE);
    for pair in lists.windows(2) {
        let [before, after] = [0, 1].map(|k| (number(&pair[k]["sequence"]), number(&pair[k]["fused_at"])));
        let gap_us = after.1.context("a time")? - before.1.context("a time")?;
        ensure!(after.0 > before.0 && gap_us < LONGEST_GAP_US, "{before:?} {after:?}");
    }
    send("CONT", stopped.process_id()?).await?;
    drop(stopped);
    send("INT", up.process_id()?).await?;
    ensure!(up.end().await?.code == Some(0));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_log_that_nobody_reads_is_a_fault_that_stops_no_hub() -> anyhow::Result<()> {
    let folder = folder("fault-log")?;
    let network = ["--network", "fault-log"];
    // Some megabytes meanwhile; the pipe of its standard error, which nobody reads for now, holds 64 KiB.
    let hub = ["hub", "--log", "trace", "--events", "--listen", "tcp/127.0.0.1:0"];
    let mut hub = V2x::start(&folder, &[&hub[..], &network].concat())?;
    let ready: Value = serde_json::from_str(&hub.line().await?)?;
    let locator = ready["locators"][0].as_str().context("a locator")?;
    let count = MEANWHILE.to_string();
    let watch = ["watch", "--json", "--count", &count, "--connect", locator];
    let watched = run(&folder, &[&watch[..], &network].concat()).await?;
    ensure!(watched.code == Some(0) && watched.stdout.lines().count() == MEANWHILE, "{watched:?}");
    hub.stderr_line("messages were left out").await?;
    send("INT", hub.process_id()?).await?;
    ensure!(hub.end().await?.code == Some(0));
    Ok(())
}

/// A number, or a number as text, which has room for 64 bits.
fn number(value: &Value) -> Option<i64> {
    value.as_i64().or_else(|| value.as_str()?.parse().ok())
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn a_full_disk_is_a_fault_that_ends_the_recording_says_so_and_ends_no_hub() -> anyhow::Result<()> {
    let folder = folder("fault-disk")?;
    std::os::unix::fs::symlink("/dev/full", folder.join("full.mcap"))?;
    let hub = ["hub", "--listen", "tcp/127.0.0.1:0", "--network", "fault-disk", "--ready-file", "ready.json"];
    let mut hub = V2x::start(&folder, &[&hub[..], &["--record", "full.mcap", "--force"]].concat())?;
    let line = hub.stderr_line("hub is ready").await?;
    let locator = line.split('"').nth(1).context("an endpoint")?.to_owned();
    let warning = hub.stderr_line("the recording ends here; the hub goes on").await?;
    ensure!(warning.contains("No space left"), "{warning}");
    let network = ["--network", "fault-disk", "--connect", &locator];
    let watched = run(&folder, &[&["watch", "--json", "--count", "20"], &network[..]].concat()).await?;
    ensure!(watched.code == Some(0) && watched.stdout.lines().count() == 20, "{watched:?}");
    let is_found = |status: &Value, _: [u64; 2]| {
        let error = status["recording"]["error"].as_str().unwrap_or_default();
        let mut findings = status["findings"].as_array().into_iter().flatten();
        let finding = findings.find(|one| one["code"] == "recording").map(|one| one["says"].to_string());
        let is_said = finding.is_some_and(|says| says.contains("No space left"));
        error.contains("No space left") && is_said && status["verdict"] == "degraded"
    };
    until(&folder, &network, "the status shows it as a fault", is_found).await?;
    send("INT", hub.process_id()?).await?;
    ensure!(hub.end().await?.code == Some(0));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frozen_agent_is_a_fault_of_its_own_that_is_reported_and_ends_when_it_runs_again()
-> anyhow::Result<()> {
    let folder = folder("fault-frozen")?;
    let mut hub = V2x::start(&folder, &["hub", "--listen", "tcp/127.0.0.1:0", "--network", "fault-frozen"])?;
    let line = hub.stderr_line("hub is ready").await?;
    let locator = line.split('"').nth(1).context("an endpoint")?.to_owned();
    let network = ["--network", "fault-frozen", "--connect", &locator];
    let agent =
        |id| V2x::start(&folder, &[&["agent", "--scenario", "crossing", "--id", id], &network[..]].concat());
    let (ego, _rsu) = (agent("ego")?, agent("rsu")?);
    until(&folder, &network, "both agents are fused", |_, [ego, rsu]| ego > 20 && rsu > 20).await?;
    send("STOP", ego.process_id()?).await?;
    let is_missed = |status: &Value, _: [u64; 2]| {
        let agents = status["agents"].as_array().into_iter().flatten();
        agents.filter(|agent| agent["id"] == "ego").any(|agent| agent["alive"] == false)
    };
    let [ego_then, rsu_then] = until(&folder, &network, "the frozen agent is missed", is_missed).await?;
    until(&folder, &network, "the other agent goes on", |_, [_, rsu]| rsu > rsu_then + 20).await?;
    send("CONT", ego.process_id()?).await?;
    until(&folder, &network, "it is fused again", |_, [ego, _]| ego > ego_then + 20).await?;
    send("INT", hub.process_id()?).await?;
    ensure!(hub.end().await?.code == Some(0));
    Ok(())
}

/// Asks for the status until it is as wanted; the frames of ego and rsu that were accepted by then.
async fn until(
    folder: &Path,
    network: &[&str],
    what: &str,
    is_so: impl Fn(&Value, [u64; 2]) -> bool,
) -> anyhow::Result<[u64; 2]> {
    let asked = async {
        loop {
            let status = run(folder, &[&["status", "--json"], network].concat()).await?;
            // One query may get no answer in time on a busy machine.
            let Ok(status) = serde_json::from_str::<Value>(&status.stdout) else { continue };
            let agents = status["agents"].as_array().cloned().unwrap_or_default();
            let accepted = |id| {
                let agent = agents.iter().find(|agent| agent["id"] == id);
                agent.and_then(|agent| agent["accepted"].as_u64()).unwrap_or(0)
            };
            let counts = [accepted("ego"), accepted("rsu")];
            if is_so(&status, counts) {
                return Ok(counts);
            }
        }
    };
    tokio::time::timeout(TIMEOUT, asked).await.with_context(|| format!("waiting until {what}"))?
}
