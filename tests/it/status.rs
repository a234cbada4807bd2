//! The status of a hub.

use crate::support::{Lab, standing};
use anyhow::Context;
use serde_json::Value;

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
