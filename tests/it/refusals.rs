//! A hub counts refused frames by reason and fuses the others.

use crate::support::{Lab, Watch, foreign_session, health, matched_publisher, rests_on, standing};
use anyhow::{Context, anyhow};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use v2x_common::clock;
use v2x_common::detection::DetectionFrame;
use v2x_common::id::{AgentId, FrameId};
use v2x_common::time::Span;
use v2x_common::wire::{self, ENCODING_JSON, ENCODING_POSTCARD};
use zenoh::time::{NTP64, Timestamp};

/// Longer than any Δmax and than any pause of a busy machine.
const MINUTE: Span = Span::from_millis(60_000);

#[tokio::test(flavor = "multi_thread")]
async fn every_kind_of_fault_in_a_frame_is_counted_by_reason_while_a_good_agent_is_fused()
-> anyhow::Result<()> {
    let lab = Lab::new("refusals")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _ego = lab.agent("ego", &hub).await?;
    let before = watch.until("ego is fused", |frame| rests_on(frame, "ego")).await?;

    let session = foreign_session(&hub).await?;
    let stranger = AgentId::new("stranger")?;
    let publisher = matched_publisher(&session, lab.keys().detections(&stranger)).await?;
    let mut expected = BTreeMap::new();
    for (reason, encoding, payload) in bad_postcard(stranger)?.into_iter().chain(bad_json()) {
        *expected.entry(reason.to_owned()).or_insert(0) += 1;
        publisher.put(payload).encoding(encoding).await.map_err(|error| anyhow!("{error}"))?;
    }
    // A valid frame and a copy of it.
    let good = serde_json::to_vec(&frame_json(Span::ZERO))?;
    expected.insert("duplicate".to_owned(), 1);
    for payload in [good.clone(), good] {
        publisher.put(payload).encoding(ENCODING_JSON).await.map_err(|error| anyhow!("{error}"))?;
    }

    let total: u64 = expected.values().sum();
    let status = watch.status_when("every bad frame is counted", |status| {
        standing(status, "stranger").is_some_and(|agent| agent.refused.values().sum::<u64>() == total)
    });
    let status = status.await?;
    let counted = standing(&status, "stranger").context("it was counted")?;
    assert_eq!(counted.refused, expected);
    assert_eq!(counted.accepted, 1);
    assert!(counted.last_refusal.as_ref().is_some_and(|words| words.contains("duplicate")), "{counted:?}");
    goes_on_being_fused(&watch, "ego", health(&before, "ego").context("ego was fused")?.accepted).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_payloads_beyond_all_measure_is_counted_and_not_read_and_the_others_go_on()
-> anyhow::Result<()> {
    let lab = Lab::new("oversized")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _ego = lab.agent("ego", &hub).await?;
    let before = watch.until("ego is fused", |frame| rests_on(frame, "ego")).await?;
    let session = foreign_session(&hub).await?;
    let publisher = matched_publisher(&session, lab.keys().detections(&AgentId::new("hoarder")?)).await?;
    let (n, text) = (20, vec![b' '; 5_000_000]);
    for _ in 0..n {
        publisher.put(text.clone()).encoding(ENCODING_JSON).await.map_err(|error| anyhow!("{error}"))?;
    }
    let refused = |status: &v2x_fusion_hub::hub::HubStatus| {
        standing(status, "hoarder").map_or(0, |agent| agent.refused.get("too_large").copied().unwrap_or(0))
    };
    let status = watch.status_when("all of them are counted", |status| refused(status) == n).await?;
    let words = standing(&status, "hoarder").and_then(|agent| agent.last_refusal.clone());
    assert_eq!(words.as_deref(), Some("5000000 bytes, at most 4194304"));
    goes_on_being_fused(&watch, "ego", health(&before, "ego").context("ego was fused")?.accepted).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_samples_with_zenoh_stamps_of_a_wrong_clock_is_taken_in_and_fills_no_log()
-> anyhow::Result<()> {
    let lab = Lab::new("stamped")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let session = foreign_session(&hub).await?;
    let publisher = matched_publisher(&session, lab.keys().detections(&AgentId::new("stamped")?)).await?;
    let n = 50;
    for _ in 0..n {
        let own = session.new_timestamp();
        // Seconds are the upper half.
        let ahead = NTP64(own.get_time().as_u64() + (3600 << 32));
        let payload = frame_json(Span::ZERO).to_string();
        let put =
            publisher.put(payload).encoding(ENCODING_JSON).timestamp(Timestamp::new(ahead, *own.get_id()));
        put.await.map_err(|error| anyhow!("{error}"))?;
    }
    let are_in = |status: &_| standing(status, "stamped").is_some_and(|agent| agent.accepted == n);
    watch.status_when("all of them are accepted", are_in).await?;
    let log = lab.hub_log()?;
    assert!(!log.contains(" ERROR ") && log.lines().count() < 20, "{log}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_log_reports_the_reason_of_refusals_once_for_each_agent() -> anyhow::Result<()> {
    let lab = Lab::new("hopeless")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let session = foreign_session(&hub).await?;
    let publisher = matched_publisher(&session, lab.keys().detections(&AgentId::new("unset-clock")?)).await?;
    for _ in 0..10 {
        let payload = serde_json::to_vec(&frame_json(MINUTE))?;
        publisher.put(payload).encoding(ENCODING_JSON).await.map_err(|error| anyhow!("{error}"))?;
    }
    let warning = "10 of 10 frames are refused (too_early)";
    let is_logged = |_: &_| lab.hub_log().is_ok_and(|log| log.contains(warning));
    let first = watch.until("the log names the agent", is_logged).await?;
    // The hub checks its statistics every second.
    let twice = Span::from_millis(2500);
    watch.until("two more checks of the statistics", |frame| frame.fused_at - first.fused_at > twice).await?;
    let log = lab.hub_log()?;
    let lines: Vec<_> = log.lines().filter(|line| line.contains(warning)).collect();
    assert_eq!(lines.len(), 1, "{log}");
    assert!(lines[0].contains("unset-clock"), "{}", lines[0]);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn an_impossible_detection_is_dropped_by_name_and_the_rest_of_its_frame_is_fused() -> anyhow::Result<()>
{
    let lab = Lab::new("impossible")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let session = foreign_session(&hub).await?;
    let carla = AgentId::new("carla")?;
    let publisher = matched_publisher(&session, lab.keys().detections(&carla)).await?;
    for _ in 0..10 {
        // Python writes NaN, which is no JSON.
        let text = format!(
            r#"{{"captured_at": {}, "detections": [{{"class": "car", "x": NaN, "y": 0}}, {{"class": "hovercraft",
            "x": 5, "y": 5}}, {{"class": "motorcycle", "x": 9, "y": 9, "w": 0.0, "d": 0.0}}]}}"#,
            clock::now().as_micros()
        );
        publisher.put(text).encoding(ENCODING_JSON).await.map_err(|error| anyhow!("{error}"))?;
    }
    let is_counted = |status: &_| standing(status, "carla").is_some_and(|agent| agent.accepted == 10);
    let status = watch.status_when("all frames are accepted", is_counted).await?;
    let agent = standing(&status, "carla").context("it was counted")?;
    assert!(agent.refused.is_empty(), "{agent:?}");
    let expected = [("w out of range".to_owned(), 10), ("x not finite".to_owned(), 10)];
    assert_eq!(agent.dropped_detections, expected.into());
    assert_eq!(agent.last_dropped.as_deref(), Some("w of detection 2 is 0, expected 0.001 to 65 m"));
    assert_eq!(agent.unmapped_names, [("hovercraft".to_owned(), 10)].into());
    watch.until("the good detection is fused", |frame| frame.objects.len() == 1).await?;
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn an_agent_whose_name_is_not_valid_is_listed_with_the_reason() -> anyhow::Result<()> {
    let lab = Lab::new("names")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let session = foreign_session(&hub).await?;
    let names = ["cam north", "cam/north", "kamera-süd"];
    for name in names {
        let publisher = matched_publisher(&session, format!("v2x/names/agent/{name}/detections")).await?;
        publisher.put(frame_json(Span::ZERO).to_string()).await.map_err(|error| anyhow!("{error}"))?;
    }
    let status = watch.status_when("all are listed", |status| status.refused_unnamed == 3).await?;
    let listed: Vec<_> = status.invalid_names.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(listed, names);
    let reasons = ["holds ' '", "holds '/'", "holds 'ü'"];
    for (one, reason) in status.invalid_names.iter().zip(reasons) {
        assert!(one.reason.contains(reason) && one.samples == 1, "{one:?}");
    }
    assert!(status.agents.is_empty(), "{:?}", status.agents);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_of_agents_with_an_invalid_name_are_counted_too() -> anyhow::Result<()> {
    let lab = Lab::new("unnamed")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let session = foreign_session(&hub).await?;
    let nameless = format!("v2x/unnamed/agent/{}/detections", "x".repeat(33));
    let publisher = matched_publisher(&session, nameless).await?;
    publisher.put(frame_json(Span::ZERO).to_string()).await.map_err(|error| anyhow!("{error}"))?;
    let status = watch.status_when("it is counted", |status| status.refused_unnamed == 1).await?;
    assert!(status.agents.is_empty(), "{:?}", status.agents);
    Ok(())
}

/// Waits until the hub has accepted ten more frames of the agent and has objects with its measurements.
async fn goes_on_being_fused(watch: &Watch, agent: &str, accepted: u64) -> anyhow::Result<()> {
    let goes_on = watch.until("the good agent goes on", |frame| {
        rests_on(frame, agent) && health(frame, agent).is_some_and(|health| health.accepted >= accepted + 10)
    });
    goes_on.await.map(|_| ())
}

type BadFrame = (&'static str, &'static str, Vec<u8>);

/// Reason, encoding and payload of damaged frames.
fn bad_postcard(agent: AgentId) -> anyhow::Result<Vec<BadFrame>> {
    let frame = DetectionFrame {
        id: FrameId { agent, epoch: 1, sequence: 1 },
        captured_at: clock::now(),
        sensor_pose: None,
        sensor_revision: 0,
        map_frame: None,
        detections: Vec::new(),
    };
    let mut good = Vec::new();
    wire::detections::encode(&frame, &mut good)?;
    let with_byte = |place: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[place] = byte;
        bytes
    };
    let mut of_another = Vec::new();
    let id = FrameId { agent: AgentId::new("ego")?, ..frame.id };
    wire::detections::encode(&DetectionFrame { id, ..frame.clone() }, &mut of_another)?;
    let bad = [
        ("truncated", Vec::new()),
        ("truncated", good[..good.len() - 1].to_vec()),
        ("trailing_bytes", [good.as_slice(), &[0]].concat()),
        ("unknown_version", with_byte(0, 99)),
        ("wrong_kind", with_byte(1, b'F')),
        ("agent_mismatch", of_another),
    ];
    Ok(bad.into_iter().map(|(reason, payload)| (reason, ENCODING_POSTCARD, payload)).collect())
}

/// Reason, encoding and payload of frames that are not JSON or have invalid values.
fn bad_json() -> Vec<BadFrame> {
    let with = |pointer: &str, value: Value| {
        let mut frame = frame_json(Span::ZERO);
        match pointer.rsplit_once('/') {
            Some((parent, field)) => frame.pointer_mut(parent).expect("it is in the frame")[field] = value,
            None => frame[pointer] = value,
        }
        frame.to_string()
    };
    let micros = clock::now().as_micros();
    let bad = [
        ("bad_json", "{\"captured_at\":".to_owned()),
        ("bad_json", with("/detections/0/theta", json!(1.0))),
        ("bad_json", with("/captured_at", json!("now"))),
        ("absurd_value", with("sensor_pose", json!({ "x": 1e300, "y": 0.0 }))),
        ("wrong_time_unit", with("captured_at", json!(micros / 1000))),
        ("wrong_time_unit", with("captured_at", json!(micros / 1_000_000))),
        ("wrong_time_unit", with("captured_at", json!(micros * 1000))),
        ("wrong_time_unit", with("captured_at", json!(12_500_000))),
        ("agent_mismatch", with("/agent", json!("ego"))),
        ("map_frame_mismatch", with("/map_frame", json!("EPSG:25833"))),
        ("too_late", frame_json(-MINUTE).to_string()),
        ("too_early", frame_json(MINUTE).to_string()),
    ];
    bad.into_iter().map(|(reason, text)| (reason, ENCODING_JSON, text.into_bytes())).collect()
}

/// A frame with a car, captured at an offset from now.
fn frame_json(ahead: Span) -> Value {
    json!({
        "captured_at": (clock::now() + ahead).as_micros(),
        "detections": [{ "class": "car", "x": 500.0, "y": 500.0 }],
    })
}
