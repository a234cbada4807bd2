//! `v2x replay` of what foreign agents have sent as JSON.

use crate::support::{TIMEOUT, V2x, folder, run, send};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::path::Path;
use v2x_common::clock;
use v2x_common::id::{AgentId, NetworkId};
use v2x_common::keys::Keys;
use v2x_common::recording::{Entry, RecordingFile, RecordingOptions};
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;

const DESCRIPTION: &str = r#"{"revision": 1, "kind": "roadside-unit", "detection_probability": 0.9, "clutter_per_m2": 0,
    "rate_hz": 20, "accuracy": {"position_m": 0, "yaw_rad": 0, "clock_s": 0},
    "field_of_view": {"range_min_m": 0, "range_max_m": 80, "azimuth_rad": 0, "width_rad": 6.283}}"#;
/// Frames of the recording, 50 ms apart.
const FRAMES: i64 = 40;

/// Writes what a camera sent as JSON an hour ago: its description, then frames with numbers as texts and without an epoch.
fn record(path: &Path, frame: fn(i64, Timestamp) -> String) -> anyhow::Result<()> {
    let mut file = RecordingFile::create(path, RecordingOptions::default())?;
    let (keys, agent) = (Keys::new(NetworkId::new("then")?), AgentId::new("cam1")?);
    let begun_at = clock::now() - Span::from_millis(3_600_000);
    let mut write = |at: Timestamp, key: String, payload: String| {
        file.write(&Entry {
            received_at: at,
            key,
            encoding: wire::ENCODING_JSON.into(),
            payload: payload.into_bytes(),
        })
    };
    write(begun_at, keys.sensor(&agent), DESCRIPTION.into())?;
    for number in 0..FRAMES {
        let captured_at = begun_at + Span::from_millis(50 * number);
        write(captured_at + Span::from_millis(20), keys.detections(&agent), frame(number, captured_at))?;
    }
    file.finish()?;
    Ok(())
}

fn numbered(number: i64, captured_at: Timestamp) -> String {
    let (at, x) = (captured_at.as_micros(), 10 + number);
    format!(
        r#"{{"captured_at": {at}, "sequence": "{number}", "detections": [{{"class": "car", "x": {x}, "y": 3}}]}}"#
    )
}

/// A hub of the network `again`, and its endpoint.
async fn hub(folder: &Path) -> anyhow::Result<(V2x, String)> {
    let mut hub =
        V2x::start(folder, &["hub", "--network", "again", "--listen", "tcp/127.0.0.1:0", "--events"])?;
    let ready: Value = serde_json::from_str(&hub.line().await?)?;
    let endpoint = ready["locators"][0].as_str().context("no endpoint")?.to_owned();
    Ok((hub, endpoint))
}

/// What the hub says of the camera.
async fn camera(folder: &Path, endpoint: &str) -> anyhow::Result<Value> {
    let status = run(folder, &["status", "--json", "--network", "again", "--connect", endpoint]).await?;
    let status: Value = serde_json::from_str(&status.stdout).with_context(|| format!("{status:#?}"))?;
    let text = status.to_string();
    let agents = status.pointer("/agents").or_else(|| status.pointer("/0/agents"));
    let cameras = agents.and_then(Value::as_array).with_context(|| format!("no agents in {text}"))?;
    Ok(cameras.iter().find(|one| one["id"] == "cam1").cloned().unwrap_or_default())
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_as_json_are_taken_by_a_hub_of_today_and_again_at_each_round() -> anyhow::Result<()> {
    let folder = folder("replay-loop")?;
    record(&folder.join("run.mcap"), numbered)?;
    let (_hub, endpoint) = hub(&folder).await?;
    let args = ["replay", "run.mcap", "--network", "again", "--speed", "4", "--loop", "--connect", &endpoint];
    let replay = V2x::start(&folder, &args)?;
    let awaited = async {
        loop {
            let camera = camera(&folder, &endpoint).await?;
            if camera["accepted"].as_i64().is_some_and(|accepted| accepted > 3 * FRAMES) {
                return anyhow::Ok(camera);
            }
        }
    };
    let camera = tokio::time::timeout(TIMEOUT, awaited).await.context("the hub takes too few")??;
    let refused = camera["refused"].as_object().context("refused")?;
    ensure!(refused.is_empty(), "{camera:#}");
    ensure!(camera["sensor"]["revision"] == 1, "{camera:#}");
    send("INT", replay.process_id()?).await?;
    let ending = replay.end().await?;
    ensure!(ending.code == Some(0) && !ending.stderr.contains("old stamps"), "{ending:#?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_replay_begins_where_it_is_to_with_what_was_described_before() -> anyhow::Result<()> {
    let folder = folder("replay-from")?;
    record(&folder.join("run.mcap"), numbered)?;
    let (_hub, endpoint) = hub(&folder).await?;
    let replay = ["replay", "run.mcap", "--network", "again", "--connect", &endpoint];
    let ending = run(&folder, &[&replay[..], &["--from", "1s"]].concat()).await?;
    ensure!(ending.code == Some(0) && ending.stderr.contains("frames=20"), "{ending:#?}");
    let camera = camera(&folder, &endpoint).await?;
    ensure!(camera["accepted"] == 20 && camera["sensor"]["revision"] == 1, "{camera:#}");
    let ending = run(&folder, &[&replay[..], &["--from", "1min"]].concat()).await?;
    ensure!(
        ending.code == Some(1) && ending.stderr.contains("no frames of agents after --from"),
        "{ending:#?}"
    );
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_that_cannot_be_shifted_are_counted_and_a_replay_of_nothing_else_fails() -> anyhow::Result<()>
{
    let folder = folder("replay-kept")?;
    let (_hub, endpoint) = hub(&folder).await?;
    let every_other =
        |number: i64, at: Timestamp| if number % 2 == 0 { numbered(number, at) } else { "{".into() };
    record(&folder.join("half.mcap"), every_other)?;
    record(&folder.join("none.mcap"), |_, _| "{".into())?;
    let replay = |file: &'static str| ["replay", file, "--network", "again", "--speed", "20", "--connect"];
    let half = run(&folder, &[&replay("half.mcap")[..], &[&endpoint]].concat()).await?;
    ensure!(
        half.code == Some(0) && half.stderr.contains("20 of 40 frames kept their old stamps"),
        "{half:#?}"
    );
    let once = half.stderr.lines().filter(|line| line.contains("cam1 is sent with its old stamps")).count();
    ensure!(once == 1, "{half:#?}");
    let none = run(&folder, &[&replay("none.mcap")[..], &[&endpoint]].concat()).await?;
    ensure!(none.code == Some(1) && none.stderr.contains("could be shifted to today"), "{none:#?}");
    Ok(())
}
