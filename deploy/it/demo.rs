//! `v2x demo`, from start to end.

use crate::support::{folder, run};
use serde_json::Value;

#[tokio::test(flavor = "multi_thread")]
async fn the_demo_runs_four_processes_passes_and_writes_its_report() -> anyhow::Result<()> {
    let folder = folder("demo")?;
    let ending = run(&folder, &["demo", "--duration", "6s", "--json", "--out", "run"]).await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    assert_eq!(
        ending.stdout.lines().count(),
        1,
        "only the summary goes to standard output: {}",
        ending.stdout
    );
    let summary: Value = serde_json::from_str(&ending.stdout)?;

    assert_has_numbers(&summary, &FIELDS);
    assert_eq!(summary["processes"], 4);
    assert!(summary["duration_s"].as_f64().is_some_and(|duration_s| duration_s >= 6.0), "{summary:#}");
    let ids: Vec<_> = summary["agents"].as_array().into_iter().flatten().map(|agent| &agent["id"]).collect();
    assert_eq!(ids, ["ego", "rsu"]);
    for place in ["/agents/0", "/agents/1"] {
        assert_has_numbers(summary.pointer(place).unwrap_or(&Value::Null), &AGENT_FIELDS);
    }
    for name in
        ["report.md", "report.html", "about.json", "bev.svg", "scenario.toml", "run.json", "recording.mcap"]
    {
        let length = std::fs::metadata(folder.join("run").join(name)).map_or(0, |metadata| metadata.len());
        assert!(length > 0, "{name} is missing or empty");
    }
    let page = std::fs::read_to_string(folder.join("run/report.html"))?;
    let place = |text: &str| page.find(text).unwrap_or(usize::MAX);
    assert!(place("class=\"verdict good\"") < place("<table>"), "the verdict comes first");
    for part in ["Errors over time", "NEES/2", "hub → consumer", "NIS/2", "Key frames", "worst moment"] {
        assert!(page.contains(part), "{part} is missing");
    }
    assert!(
        !["http://", "https://", "src="]
            .iter()
            .any(|link| { page.replace("http://www.w3.org/2000/svg", "").contains(link) }),
        "the page needs nothing from elsewhere"
    );
    let written: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("run/summary.json"))?)?;
    assert_eq!(written, summary);
    Ok(())
}

const FIELDS: [&str; 19] = [
    "/fused/ate_m",
    "/fused/ade_m",
    "/fused/aoe_deg",
    "/fused/precision",
    "/fused/recall",
    "/fused/gospa_m",
    "/fused/common/ate_m",
    "/latency_ms/p50",
    "/latency_ms/p95",
    "/latency_ms/p99",
    "/compute_ms/p50",
    "/compute_ms/p99",
    "/end_to_end_ms/p50",
    "/end_to_end_ms/p99",
    "/age_of_information_ms/p50",
    "/age_of_information_ms/p99",
    "/processes",
    "/seed",
    "/match_radius_m",
];

const AGENT_FIELDS: [&str; 7] =
    ["/ate_m", "/ade_m", "/aoe_deg", "/common/ate_m", "/frames_sent", "/frames_received", "/frames_refused"];

fn assert_has_numbers(json: &Value, pointers: &[&str]) {
    for pointer in pointers {
        assert!(json.pointer(pointer).is_some_and(Value::is_number), "{pointer} in {json:#}");
    }
}
