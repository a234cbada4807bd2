//! A hub as a supervisor and a monitoring system see it.

use crate::support::{TIMEOUT, V2x, folder, run, send};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::path::Path;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

const DOCUMENT: &str = include_str!("../docs/metrics.md");

#[tokio::test(flavor = "multi_thread")]
async fn health_and_the_ready_file_say_what_a_hub_is_in_with_and_without_a_fault() -> anyhow::Result<()> {
    let folder = folder("monitoring-health")?;
    let file = folder.join("ready.json");
    std::fs::write(&file, "of an earlier hub")?;
    let args = ["hub", "--listen", "tcp/127.0.0.1:0", "--metrics", "0", "--ready-file", "ready.json"];
    let mut hub = V2x::start(&folder, &args)?;
    let address = address(&hub.stderr_line("metrics and health at").await?)?;
    hub.stderr_line("hub is ready").await?;
    let ready = until("the ready file", || async { Ok(std::fs::read_to_string(&file).ok()) }).await?;
    let ready: Value = serde_json::from_str(&ready)?;
    let locator = ready["locators"][0].as_str().context("an endpoint")?.to_owned();
    ensure!(ready["hub"] == "hub" && ready["network"] == "demo", "{ready}");
    until("a published list", || async { Ok(get(&address, "/readyz").await?.0.then_some(())) }).await?;
    ensure!(get(&address, "/livez").await?.0);
    let (is_healthy, why) = get(&address, "/healthz").await?;
    ensure!(!is_healthy && why.contains("no agent is alive"), "{why}");
    let agent =
        V2x::start(&folder, &["agent", "--scenario", "crossing", "--id", "ego", "--connect", &locator])?;
    until("a healthy hub", || async { Ok(get(&address, "/healthz").await?.0.then_some(())) }).await?;
    // It is killed: nobody says goodbye.
    drop(agent);
    until("the agent to be missed", || async {
        let (is_healthy, why) = get(&address, "/healthz").await?;
        Ok((!is_healthy && why.contains("no agent is alive")).then_some(()))
    })
    .await?;
    ensure!(get(&address, "/readyz").await?.0, "without agents it still publishes");
    send("TERM", hub.process_id()?).await?;
    let ending = hub.end().await?;
    ensure!(ending.code == Some(0) && !file.exists(), "{ending:?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_ready_file_that_cannot_be_written_is_a_fault_that_ends_the_hub() -> anyhow::Result<()> {
    let folder = folder("monitoring-unwritable")?;
    let args =
        ["hub", "--listen", "tcp/127.0.0.1:0", "--network", "unwritable", "--ready-file", "none/ready.json"];
    let ending = run(&folder, &args).await?;
    ensure!(ending.code == Some(1) && ending.stderr.contains("--ready-file none/ready.json"), "{ending:?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn every_documented_metric_is_exported_and_no_other() -> anyhow::Result<()> {
    let folder = folder("monitoring-metrics")?;
    let args = ["up", "crossing", "--listen", "tcp/127.0.0.1:0", "--network", "metrics", "--out", "run"];
    let mut up = V2x::start(&folder, &[&args[..], &["--metrics", "0", "--log-format", "json"]].concat())?;
    up.stderr_line("crossing is up").await?;
    let log = std::fs::read_to_string(folder.join("run/logs/hub.log"))?;
    let line = log.lines().find(|line| line.contains("metrics and health at")).context("the address")?;
    let line: Value = serde_json::from_str(line).with_context(|| format!("a line of JSON: {line}"))?;
    let address = address(line["fields"]["message"].as_str().context("its message")?)?;
    let text = until("frames of both agents in lists", || async {
        let (_, text) = get(&address, "/metrics").await?;
        let accepted =
            |agent| value(&text, &format!("v2x_hub_agent_frames_accepted_total{{agent=\"{agent}\"}}"));
        let learnt = text.contains("v2x_hub_agent_rate_hertz{");
        let arrived = accepted("ego") > Some(20.0) && accepted("rsu") > Some(20.0);
        Ok((arrived && learnt && value(&text, "v2x_hub_objects") > Some(3.0)).then_some(text))
    })
    .await?;
    let exported: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("# TYPE ")).collect();
    let exported: Vec<_> = exported.iter().filter_map(|line| line.split(' ').next()).collect();
    let documented: Vec<_> = DOCUMENT.lines().filter_map(|line| line.strip_prefix("| `")).collect();
    let documented: Vec<_> = documented.iter().filter_map(|line| line.split(['`', '{']).next()).collect();
    // The document has the names as they are queried: with the suffixes of counters and of infos.
    let queried = |name: &str| name.trim_end_matches("_total").trim_end_matches("_info").to_owned();
    ensure!(
        documented.iter().map(|name| queried(name)).eq(exported.iter().map(|name| (*name).to_owned())),
        "documented {documented:#?}, exported {exported:#?}"
    );
    let counted = value(&text, "v2x_hub_latency_seconds_count").context("a count")?;
    let within = value(&text, "v2x_hub_latency_seconds_bucket{le=\"+Inf\"}").context("the last class")?;
    ensure!(counted > 20.0 && counted.to_bits() == within.to_bits(), "{counted} {within}");
    ensure!(value(&text, "v2x_hub_cpu_seconds_total") > Some(0.0) && text.ends_with("# EOF\n"));
    ensure!(value(&text, "v2x_hub_candidates_total") > Some(20.0));
    send("INT", up.process_id()?).await?;
    ensure!(up.end().await?.code == Some(0));
    Ok(())
}

#[tokio::test]
async fn a_taken_address_of_metrics_is_a_fault_that_says_what_to_do() -> anyhow::Result<()> {
    let taken = std::net::TcpListener::bind("127.0.0.1:0")?;
    let address = taken.local_addr()?.to_string();
    let ending = run(Path::new("."), &["hub", "--listen", "tcp/127.0.0.1:0", "--metrics", &address]).await?;
    ensure!(ending.code == Some(1) && ending.stderr.contains("--metrics 127.0.0.1:0"), "{ending:?}");
    Ok(())
}

/// The address in the line that reports it.
fn address(line: &str) -> anyhow::Result<String> {
    let address = line.split("http://").nth(1).and_then(|rest| rest.strip_suffix("/metrics"));
    Ok(address.with_context(|| format!("an address in {line:?}"))?.to_owned())
}

/// The value of a series.
fn value(text: &str, series: &str) -> Option<f64> {
    text.lines().find_map(|line| line.strip_prefix(series)?.strip_prefix(' ')?.parse().ok())
}

/// Whether the answer is 200, and its body.
async fn get(address: &str, path: &str) -> anyhow::Result<(bool, String)> {
    let mut stream = TcpStream::connect(address).await?;
    stream
        .write_all(format!("GET {path} HTTP/1.1\r\nHost: hub\r\nConnection: close\r\n\r\n").as_bytes())
        .await?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await?;
    let (head, body) = answer.split_once("\r\n\r\n").context("a head and a body")?;
    Ok((head.starts_with("HTTP/1.1 200 "), body.to_owned()))
}

/// Asks until there is an answer.
async fn until<T, F>(what: &str, ask: impl Fn() -> F) -> anyhow::Result<T>
where
    F: Future<Output = anyhow::Result<Option<T>>>,
{
    let asked = async {
        loop {
            if let Some(answer) = ask().await? {
                return Ok(answer);
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    tokio::time::timeout(TIMEOUT, asked).await.with_context(|| format!("waiting for {what}"))?
}
