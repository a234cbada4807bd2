//! The status of a hub.

use crate::support::{Lab, foreign_session, matched_publisher, standing};
use anyhow::{Context, anyhow, ensure};
use serde_json::Value;
use v2x_common::id::{AgentId, HubId};
use v2x_common::wire::ENCODING_JSON;
use v2x_fusion_hub::hub::HubStatus;

#[tokio::test(flavor = "multi_thread")]
async fn the_status_query_answers_with_the_documented_fields() -> anyhow::Result<()> {
    let lab = Lab::new("status")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _rsu = lab.agent("rsu", &hub).await?;
    let is_described = |status: &_| {
        standing(status, "rsu").is_some_and(|rsu| rsu.alive && rsu.accepted > 0 && rsu.sensor.is_some())
    };
    watch.status_when("rsu is known whole", is_described).await?;
    let status = watch.status_json().await?.context("no answer")?;

    assert_eq!(status["hub"], "hub");
    assert_eq!(status["network"], "status");
    assert_eq!(status["locators"][0], hub.locator.as_str());
    assert!(status["version"].is_string());
    let counts = [
        "lineage",
        "tracks",
        "objects",
        "frames_published",
        "publish_errors",
        "dropped_overload",
        "refused_beyond_limit",
        "refused_unnamed",
        "births_refused",
    ];
    for field in counts {
        assert!(status[field].is_u64(), "{field} in {status:#}");
    }
    let (started_at, now) = (status["started_at"].as_i64(), status["now"].as_i64());
    assert!(started_at.is_some() && started_at < now, "{status:#}");
    for span in ["latency_ms", "compute_ms"] {
        assert!(status[span]["count"].as_u64() > Some(0), "{span} in {status:#}");
        assert!(
            ["p50", "p95", "p99", "max"].iter().all(|rank| status[span][rank].is_f64()),
            "{span} in {status:#}"
        );
    }
    if cfg!(target_os = "linux") {
        assert!(status["memory_bytes"].as_u64() > Some(1 << 20), "{status:#}");
    }
    assert!(status["invalid_names"].as_array().is_some_and(Vec::is_empty), "{status:#}");
    assert_is_rsu(&status["agents"]);
    Ok(())
}

/// Good, bad and left-out descriptions, tokens, and questions for both things that a hub can be asked.
#[tokio::test(flavor = "multi_thread")]
async fn control_messages_are_accounted_for_by_what_became_of_them_and_no_fault_of_one_hides_another()
-> anyhow::Result<()> {
    let lab = Lab::with_settings("control-counts", "only_agents = [\"rsu\", \"cam\"]\n")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _rsu = lab.agent("rsu", &hub).await?;
    let session = foreign_session(&hub).await?;
    let [cam, stranger] = [AgentId::new("cam")?, AgentId::new("stranger")?];
    let description = |agent| matched_publisher(&session, lab.keys().sensor(agent));
    let (of_cam, of_stranger) = (description(&cam).await?, description(&stranger).await?);
    const BAD: u64 = 40;
    for _ in 0..BAD {
        for publisher in [&of_cam, &of_stranger] {
            publisher
                .put("{\"revision\": \"x\"}")
                .encoding(ENCODING_JSON)
                .await
                .map_err(|error| anyhow!("{error}"))?;
        }
    }
    let token = session.liveliness().declare_token(lab.keys().agent_alive(&cam)).await;
    let token = token.map_err(|error| anyhow!("{error}"))?;
    let journal =
        session.get(lab.keys().journal(&HubId::new("hub")?)).await.map_err(|error| anyhow!("{error}"))?;
    ensure!(journal.recv_async().await.is_ok(), "the journal's start is answered");
    token.undeclare().await.map_err(|error| anyhow!("{error}"))?;
    let is_counted = |status: &HubStatus| {
        let control = &status.control;
        control.descriptions_refused == BAD
            && control.descriptions_left_out == BAD
            && control.descriptions > 0
            // Of rsu, and of cam that came and went.
            && control.liveliness >= 3
    };
    let status = watch.status_when("all of them are counted", is_counted).await?;
    let control = status.control;
    assert_eq!(control.received, control.accounted(), "{control:?}");
    assert_eq!((control.dropped, control.queries_of_others), (0, 0), "{control:?}");
    assert!(control.queries >= 2, "the journal, and this status: {control:?}");
    assert_eq!(standing(&status, "cam").map(|cam| cam.descriptions_refused), Some(BAD));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_queries_that_carry_much_is_refused_and_counted_and_others_are_answered()
-> anyhow::Result<()> {
    let lab = Lab::new("large-queries")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let session = foreign_session(&hub).await?;
    let key = lab.keys().status(&HubId::new("hub")?);
    let asked = async |payload: usize, attachment: usize, parameters: usize| {
        let selector = format!("{key}?a={}", "x".repeat(parameters));
        let replies = session.get(selector).payload(vec![0; payload]).attachment(vec![0; attachment]);
        let replies = replies.await.map_err(|error| anyhow!("{error}"))?;
        Ok::<_, anyhow::Error>(replies.recv_async().await.is_ok())
    };
    ensure!(asked(1000, 1000, 2000).await?, "a small one is answered");
    for (payload, attachment, parameters) in
        [(1 << 20, 1, 1), (1, 1 << 20, 1), (1, 1, 60_000), (2000, 2000, 200)]
    {
        ensure!(!asked(payload, attachment, parameters).await?, "{payload} {attachment} {parameters}");
    }
    let status = watch.status_when("they are counted", |status| status.control.queries_refused == 4).await?;
    assert_eq!(status.control.received, status.control.accounted(), "{:?}", status.control);
    Ok(())
}

fn assert_is_rsu(agents: &Value) {
    let rsu = &agents[0];
    assert_eq!(agents.as_array().map(Vec::len), Some(1));
    assert_eq!((&rsu["id"], &rsu["alive"]), (&"rsu".into(), &true.into()));
    for field in ["accepted", "out_of_sequence", "unmapped_classes", "newest_captured_at"] {
        assert!(rsu[field].is_u64(), "{field} in {rsu:#}");
    }
    assert!(rsu["dropped_detections"].is_object() && rsu["unmapped_names"].is_object(), "{rsu:#}");
    assert!(rsu["refused"].is_object() && rsu.get("last_refusal").is_some(), "{rsu:#}");
    assert_eq!(rsu["sensor"]["kind"], "roadside-unit");
    let registration = &rsu["registration"];
    assert_eq!((&registration["reference"], &registration["relative_only"]), (&true.into(), &false.into()));
    for field in ["dx_m", "dyaw_deg", "clock_ms", "clock_sigma_ms", "applied_dx_m", "applied_clock_ms"] {
        assert!(registration[field].is_f64(), "{field} in {registration:#}");
    }
}
