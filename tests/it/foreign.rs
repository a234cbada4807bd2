//! A client that uses only Zenoh and JSON.

use crate::support::{Lab, PATIENCE, foreign_session, matched_publisher};
use anyhow::{Context, anyhow, bail};
use serde_json::{Value, json};
use std::time::Duration;
use v2x_common::clock;
use v2x_common::wire::{self, ENCODING_JSON};
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::sample::Sample;

/// Frame rate of the foreign camera.
const INTERVAL: Duration = Duration::from_millis(100);

#[tokio::test(flavor = "multi_thread")]
async fn a_json_client_is_fused_and_reads_fused_objects_as_json() -> anyhow::Result<()> {
    let lab = Lab::new("foreign")?;
    let hub = lab.hub().await?;
    let session = foreign_session(&hub).await?;
    let camera = matched_publisher(&session, "v2x/foreign/agent/camera/detections".to_owned()).await?;
    let fused = session.declare_subscriber("v2x/foreign/hub/*/fused/json").await;
    let fused = fused.map_err(|error| anyhow!("{error}"))?;

    let found = tokio::time::timeout(PATIENCE, camera_until_fused(&camera, &fused)).await;
    let (sample, frame) = found.context("the camera's cone is not in the fused frames")??;
    assert_eq!(sample.encoding().to_string(), ENCODING_JSON);
    wire::json::decode_fused(&sample.payload().to_bytes())?;
    assert_eq!(frame["hub"], "hub");
    assert!(
        frame["fused_at"].is_i64() && frame["sequence"].is_string() && frame["lineage"].is_u64(),
        "{frame:#}"
    );
    assert_eq!(frame["agents"][0]["agent"], "camera");

    assert_eq!(frame["objects"].as_array().map(Vec::len), Some(1), "{frame:#}");
    let cone = &frame["objects"][0];
    assert_eq!(cone["class"], "movable_object.trafficcone");
    let number =
        |field: &str| cone[field].as_f64().with_context(|| format!("{field} is no number: {cone:#}"));
    // The detection is exact and constant, so the error is at most the resolution of the codec.
    assert!((number("x")? - 12.5).abs() < 0.1 && (number("y")? + 7.25).abs() < 0.1, "{cone:#}");
    assert!((0.5..=1.0).contains(&number("existence")?), "{cone:#}");
    assert!(cone["track"].is_string() && cone["sigma"]["x"].is_f64(), "{cone:#}");
    Ok(())
}

/// Puts a cone at 10 Hz until a fused frame contains it.
async fn camera_until_fused(
    camera: &Publisher<'_>,
    fused: &Subscriber<FifoChannelHandler<Sample>>,
) -> anyhow::Result<(Sample, Value)> {
    let mut shutter = tokio::time::interval(INTERVAL);
    loop {
        tokio::select! {
            _ = shutter.tick() => {
                let frame = json!({
                    "captured_at": clock::now().as_micros(),
                    "detections": [{ "class": "cone", "x": 12.5, "y": -7.25 }],
                });
                let put = camera.put(frame.to_string()).encoding(ENCODING_JSON).await;
                put.map_err(|error| anyhow!("{error}"))?;
            }
            sample = fused.recv_async() => {
                let Ok(sample) = sample else { bail!("the subscription has ended") };
                let frame: Value = serde_json::from_slice(&sample.payload().to_bytes())?;
                if frame["objects"][0]["contributors"][0]["agent"] == "camera" {
                    return Ok((sample, frame));
                }
            }
        }
    }
}
