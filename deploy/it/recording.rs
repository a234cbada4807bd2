//! Recording, computing again, and replaying, by whole processes.

use crate::support::{TIMEOUT, V2x, folder, run, send, up_with};
use anyhow::{Context, ensure};
use std::path::Path;
use std::process::Command;
use v2x_common::keys::Topic;
use v2x_common::recording::{Entry, Recording};
use v2x_common::wire;
use v2x_lab::commands::{ReportArgs, RetrackArgs, report, retrack};

/// The crossing over links that reorder heavily, with an agent whose clock and pose err, so that registration corrects them.
fn hard_scenario(folder: &Path) -> anyhow::Result<()> {
    let crossing = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/crossing.toml"))?;
    let link = "link = { delay_ms = 80, jitter_ms = 30, loss = 0.01 }\n";
    let unit = "kind = \"roadside-unit\"\n";
    ensure!(crossing.contains(link) && crossing.contains(unit), "the crossing has changed");
    let reordering = "link = { delay_ms = 150, jitter_ms = 120, loss = 0.05 }\n";
    let erring = format!("{unit}clock = {{ offset_ms = 40 }}\n");
    std::fs::write(folder.join("hard.toml"), crossing.replace(link, reordering).replacen(unit, &erring, 1))?;
    Ok(())
}

fn entries(path: &Path) -> anyhow::Result<Vec<Entry>> {
    let recording = Recording::open(path).with_context(|| format!("opening {}", path.display()))?;
    Ok(recording.collect::<Result<_, _>>()?)
}

fn late_share(entries: &[Entry]) -> anyhow::Result<f64> {
    let last = entries.iter().rfind(|entry| matches!(Topic::of(&entry.key), Some(Topic::Fused(_))));
    let last = wire::fused::decode(&last.context("no list")?.payload)?;
    let sum = |of: fn(&v2x_common::fused::AgentHealth) -> u64| last.agents.iter().map(of).sum::<u64>();
    Ok(sum(|agent| agent.out_of_sequence) as f64 / sum(|agent| agent.accepted) as f64)
}

/// Whether the recording is computed again to the same bits.
pub(crate) fn is_identical(path: &Path) -> anyhow::Result<bool> {
    #[derive(clap::Parser)]
    struct Retrack {
        #[command(flatten)]
        args: RetrackArgs,
    }
    let args = <Retrack as clap::Parser>::try_parse_from([Path::new("retrack"), path])?;
    Ok(retrack(&args.args)? == std::process::ExitCode::SUCCESS)
}

/// Until the hub corrects an agent's clock.
async fn wait_for_registration(folder: &Path, endpoint: &str) -> anyhow::Result<()> {
    let waited = async {
        loop {
            let status = ["status", "--json", "--network", "recording", "--connect", endpoint];
            let status = run(folder, &status).await?.stdout;
            let status: serde_json::Value = serde_json::from_str(&status)?;
            let agents = status.pointer("/0/agents").or(status.pointer("/agents"));
            let agents = agents.and_then(|agents| agents.as_array()).context("a status has agents")?;
            let applied = |agent: &serde_json::Value| agent["registration"]["applied_clock_ms"].as_f64();
            if agents.iter().filter_map(applied).any(|ms| ms.abs() > 5.0) {
                return anyhow::Ok(());
            }
        }
    };
    tokio::time::timeout(TIMEOUT, waited).await.context("no clock is corrected")?
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_of_a_network_that_is_up_is_scored_by_the_scenario_in_it_wherever_it_lies()
-> anyhow::Result<()> {
    let folder = folder("recording-scored")?;
    let args = ["up", "crossing", "--listen", "tcp/127.0.0.1:0", "--network", "scored", "--out", "run"];
    let mut up = V2x::start(&folder, &[&args[..], &["--record", "run.mcap"]].concat())?;
    let line = up.stderr_line(" is up: hub at ").await?;
    let endpoint = line.split_whitespace().find(|word| word.starts_with("tcp/")).context("no endpoint")?;
    // Scoring begins two seconds after all agents are there.
    let endpoint = endpoint.trim_end_matches(',');
    let lists = ["watch", "--json", "--count", "120", "--network", "scored", "--connect", endpoint];
    ensure!(run(&folder, &lists).await?.code == Some(0));
    interrupt(&up)?;
    let ending = up.end().await?;
    ensure!(ending.code == Some(0), "{ending:#?}");
    std::fs::create_dir(folder.join("elsewhere"))?;
    let path = folder.join("elsewhere/kept.mcap");
    std::fs::rename(folder.join("run.mcap"), &path)?;
    std::fs::remove_dir_all(folder.join("run"))?;
    #[derive(clap::Parser)]
    struct Report {
        #[command(flatten)]
        args: ReportArgs,
    }
    let args = <Report as clap::Parser>::try_parse_from([Path::new("report"), &path])?;
    report(&args.args)?;
    let page = std::fs::read_to_string(path.with_extension("html"))?;
    ensure!(page.contains("class=\"verdict") && page.contains("Errors over time"), "it is not scored");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_network_that_is_joined_in_the_middle_is_computed_again_and_replayed_into_a_second_hub()
-> anyhow::Result<()> {
    let folder = folder("recording")?;
    hard_scenario(&folder)?;
    let (_up, endpoint) = up_with(&folder, "hard.toml", "recording").await?;
    // The recorder joins once there are objects.
    let there = ["watch", "--json", "--count", "100", "--network", "recording", "--connect", &endpoint];
    ensure!(run(&folder, &there).await?.code == Some(0));
    wait_for_registration(&folder, &endpoint).await?;
    let record = ["record", "run.mcap", "--count", "300", "--network", "recording", "--connect", &endpoint];
    let ending = run(&folder, &record).await?;
    ensure!(ending.code == Some(0) && ending.stderr.contains("with the journal"), "{ending:#?}");
    let path = folder.join("run.mcap");
    let recorded = entries(&path)?;
    ensure!(late_share(&recorded)? > 0.1, "links reorder heavily: {}", late_share(&recorded)?);
    ensure!(is_identical(&path)?, "the live run is not computed again to the same bits");

    let ending = run(&folder, &record).await?;
    ensure!(ending.code == Some(1) && ending.stderr.contains("exists"), "{ending:#?}");

    let mut hub = V2x::start(
        &folder,
        &["hub", "--network", "again", "--listen", "tcp/127.0.0.1:0", "--record", "again.mcap", "--events"],
    )?;
    let ready = hub.line().await?;
    let ready: serde_json::Value = serde_json::from_str(&ready)?;
    let endpoint = ready["locators"][0].as_str().context("no endpoint")?.to_owned();
    let replay = ["replay", "run.mcap", "--network", "again", "--speed", "2", "--connect", &endpoint];
    let ending = run(&folder, &replay).await?;
    ensure!(ending.code == Some(0), "{ending:#?}");
    interrupt(&hub)?;
    let ending = hub.end().await?;
    ensure!(ending.code == Some(0), "{ending:#?}");
    let again = entries(&folder.join("again.mcap"))?;
    let count = |entries: &[Entry], is: fn(&Topic) -> bool| {
        entries.iter().filter(|entry| Topic::of(&entry.key).as_ref().is_some_and(is)).count()
    };
    let frames = |entries: &[Entry]| count(entries, |topic| matches!(topic, Topic::Detections(_)));
    let (sent, arrived) = (frames(&recorded), frames(&again));
    ensure!(arrived + 3 >= sent && arrived <= sent, "{sent} frames were replayed, {arrived} arrived");
    let list = again.iter().rfind(|entry| matches!(Topic::of(&entry.key), Some(Topic::Fused(_))));
    let list = wire::fused::decode(&list.context("no list")?.payload)?;
    ensure!(list.objects.len() > 10, "{} objects of the replayed frames", list.objects.len());
    ensure!(is_identical(&folder.join("again.mcap"))?, "the hub's own recording");
    Ok(())
}

fn interrupt(hub: &V2x) -> anyhow::Result<()> {
    let killed = Command::new("kill").args(["-INT", &hub.process_id()?.to_string()]).status()?;
    ensure!(killed.success());
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_replay_of_no_recording_and_a_recording_without_a_journal_say_what_is_wrong() -> anyhow::Result<()>
{
    let folder = folder("recording-none")?;
    std::fs::write(folder.join("text.mcap"), "no recording at all")?;
    let ending = run(&folder, &["replay", "text.mcap"]).await?;
    ensure!(ending.code == Some(1) && ending.stderr.contains("not a recording"), "{ending:#?}");
    let (_up, endpoint) = up_with(&folder, "crossing", "recording-none").await?;
    let args = ["watch", "--delta", "--record", "delta.mcap", "--count", "5", "--network", "recording-none"];
    ensure!(run(&folder, &[&args[..], &["--connect", &endpoint]].concat()).await?.code == Some(0));
    let error = format!("{:#}", is_identical(&folder.join("delta.mcap")).err().context("it has no journal")?);
    ensure!(error.contains("nothing to compare") && error.contains("v2x record"), "{error}");
    Ok(())
}

/// The hub's own recording that goes on with the next number, whatever the hub before left.
async fn hub_that_records(folder: &Path) -> anyhow::Result<V2x> {
    let args =
        ["hub", "--network", "again", "--listen", "tcp/127.0.0.1:0", "--events", "--record", "run.mcap"];
    let mut hub = V2x::start(folder, &[&args[..], &["--rotate-mb", "500", "--rotate-min", "60"]].concat())?;
    hub.line().await?;
    Ok(hub)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hub_that_crashed_is_started_again_by_the_same_command_and_its_recording_goes_on_beside()
-> anyhow::Result<()> {
    let folder = folder("recording-restarted")?;
    let first = hub_that_records(&folder).await?;
    send("KILL", first.process_id()?).await?;
    first.end().await?;
    let left = std::fs::read(folder.join("run.mcap"))?;
    let second = hub_that_records(&folder).await?;
    interrupt(&second)?;
    let ending = second.end().await?;
    ensure!(ending.code == Some(0), "{ending:#?}");
    ensure!(ending.stderr.contains("run-2.mcap") && ending.stderr.contains("goes on beside"), "{ending:#?}");
    ensure!(std::fs::read(folder.join("run.mcap"))? == left, "what the first one left was changed");
    entries(&folder.join("run-2.mcap"))?;
    // Without files that rotate nothing else was asked for.
    let args = ["hub", "--network", "again", "--listen", "tcp/127.0.0.1:0", "--record", "run.mcap"];
    let refused = run(&folder, &args).await?;
    ensure!(refused.code == Some(1) && refused.stderr.contains("exists"), "{refused:#?}");
    // A hub that cannot begin leaves no file behind, however often it is tried.
    let taken = std::net::TcpListener::bind("127.0.0.1:0")?;
    let endpoint = format!("tcp/{}", taken.local_addr()?);
    let args = ["hub", "--listen", &endpoint, "--record", "run.mcap", "--rotate-mb", "500"];
    let refused = run(&folder, &args).await?;
    ensure!(refused.code == Some(1) && !folder.join("run-3.mcap").exists(), "{refused:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_ends_after_its_duration() -> anyhow::Result<()> {
    let folder = folder("recording-duration")?;
    let (_up, endpoint) = up_with(&folder, "crossing", "recording-duration").await?;
    let args =
        ["record", "run.mcap", "--duration", "2s", "--network", "recording-duration", "--connect", &endpoint];
    let ending = run(&folder, &args).await?;
    ensure!(ending.code == Some(0) && ending.stderr.contains("recorded "), "{ending:#?}");
    let recorded = entries(&folder.join("run.mcap"))?;
    let (first, last) = (recorded.first().context("empty")?, recorded.last().context("empty")?);
    let lasted_s = (last.received_at - first.received_at).as_secs_f64();
    ensure!((1.0..4.0).contains(&lasted_s), "{lasted_s} s");
    Ok(())
}
