//! Many connections and sessions at once: those that are there go on, and what is opened beside them is bounded.

use super::network::{Secured, certs, config_of, hub};
use crate::support::{self, TIMEOUT, V2x};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::path::Path;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use v2x_fusion_hub::diagnosis::Code;
use v2x_fusion_hub::hub::HubStatus;

/// Connections of one flood: more than Zenoh lets wait for a handshake at once.
const CONNECTIONS: usize = 240;
/// The longest time between two lists meanwhile, µs; a machine may be busy.
const LONGEST_GAP_US: i64 = 3_000_000;

/// Opens connections of which none gets further than these bytes.
async fn half_open(endpoint: &str, first_bytes: &[u8]) -> anyhow::Result<Vec<TcpStream>> {
    let (_, address) = endpoint.split_once('/').context("no protocol")?;
    let mut streams = Vec::new();
    for _ in 0..CONNECTIONS / 2 {
        let opened = tokio::time::timeout(TIMEOUT, TcpStream::connect(address)).await;
        let mut stream = opened.context("not even a connection")??;
        stream.write_all(first_bytes).await?;
        streams.push(stream);
    }
    Ok(streams)
}

/// Until the hub has closed each of them.
async fn closed(streams: Vec<TcpStream>) -> anyhow::Result<()> {
    let all = async {
        for mut stream in streams {
            let mut buffer = [0; 256];
            // Perhaps a word why; then the end, or a reset.
            while matches!(stream.read(&mut buffer).await, Ok(count) if count > 0) {}
        }
    };
    tokio::time::timeout(TIMEOUT, all).await.context("half-open connections stay for ever")
}

/// A consumer that was there before.
struct Before(V2x);

impl Before {
    async fn start(folder: &Path, args: &[&str]) -> anyhow::Result<Self> {
        let mut watch = V2x::start(folder, &[&["watch", "--json"], args].concat())?;
        watch.line().await?;
        Ok(Self(watch))
    }

    /// So many further lists come, each soon after the one before.
    async fn goes_on(&mut self, lists: usize) -> anyhow::Result<()> {
        let mut last = None;
        for _ in 0..lists {
            let list: Value = serde_json::from_str(&self.0.line().await?)?;
            let at = list["fused_at"].as_i64().context("a time")?;
            let gap_us = at - last.replace(at).unwrap_or(at);
            ensure!(gap_us < LONGEST_GAP_US, "{gap_us} µs without a list");
        }
        Ok(())
    }
}

/// Half of them say nothing, half of them begin a handshake of TLS.
async fn flood(endpoint: &str, before: &mut Before) -> anyhow::Result<()> {
    let silent = half_open(endpoint, &[]).await?;
    before.goes_on(10).await?;
    let begun = half_open(endpoint, &[22, 3, 1, 2, 0, 1]).await?;
    before.goes_on(30).await?;
    closed(silent).await?;
    closed(begun).await?;
    before.goes_on(10).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_half_open_tls_connections_stops_nobody_is_closed_and_lets_new_ones_in_again()
-> anyhow::Result<()> {
    let secured = Secured::start("flood-tls", &[]).await?;
    let _ego = secured.agent("ego")?;
    let screen = config_of("viewer/screen");
    let at = ["--zenoh-config", screen.as_str(), "--connect", &secured.endpoint];
    let mut before = Before::start(&secured.folder, &at).await?;
    flood(&secured.endpoint, &mut before).await?;
    let new = support::run(&secured.folder, &[&["status", "--wait", "60"], &at[..]].concat()).await?;
    ensure!(new.code == Some(0) && new.stdout.contains("ego"), "{new:?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_half_open_tcp_connections_stops_nobody_is_closed_and_lets_new_ones_in_again()
-> anyhow::Result<()> {
    let folder = support::folder("flood-tcp")?;
    let (_up, endpoint) = support::up(&folder, "flood-tcp").await?;
    let at = ["--network", "flood-tcp", "--connect", &endpoint];
    let mut before = Before::start(&folder, &at).await?;
    flood(&endpoint, &mut before).await?;
    let new = support::run(&folder, &[&["status", "--wait", "60"], &at[..]].concat()).await?;
    ensure!(new.code == Some(0) && new.stdout.contains("ego"), "{new:?}");
    Ok(())
}

/// A hub whose configuration lets ten sessions in.
#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_sessions_by_one_certificate_is_bounded_told_by_its_name_and_the_others_go_on()
-> anyhow::Result<()> {
    const MOST: usize = 10;
    let folder = support::folder("flood-sessions")?;
    certs(&folder, &["init"]).await?;
    certs(&folder, &["agent", "ego", "--truth"]).await?;
    for viewer in ["screen", "eve"] {
        certs(&folder, &["viewer", viewer]).await?;
    }
    let file = folder.join(config_of("hub/hub"));
    let text = std::fs::read_to_string(&file)?;
    ensure!(text.contains("\"max_sessions\": 1024"), "{text}");
    std::fs::write(&file, text.replace("\"max_sessions\": 1024", &format!("\"max_sessions\": {MOST}")))?;
    let (hub, endpoint) = hub(&folder, "tls", &["--zenoh-config", &config_of("hub/hub")]).await?;
    let secured = Secured { folder, endpoint, hub };
    let _ego = secured.agent("ego")?;
    let screen = config_of("viewer/screen");
    let at = ["--zenoh-config", screen.as_str(), "--connect", &secured.endpoint];
    let mut before = Before::start(&secured.folder, &at).await?;
    before.goes_on(5).await?;
    let asks = secured.watch().await?;
    let mut sessions = Vec::new();
    for _ in 0..MOST - 3 {
        sessions.push(secured.session("viewer/eve").await?);
    }
    let is_told = |status: &HubStatus| {
        let finding = status.findings.iter().find(|one| one.code == Code::Sessions && one.is_fault());
        finding.is_some_and(|one| one.says.contains("viewer:eve holds 7 of 10, from 127.0.0.1"))
    };
    let full = asks.until("the hub says who has taken its places", is_told).await?;
    ensure!((full.sessions.total, full.sessions.limit) == (MOST, MOST), "{:?}", full.sessions);
    // One more is not let in, whoever asks.
    let late = support::run(&secured.folder, &[&["status", "--wait", "2"], &at[..]].concat()).await?;
    ensure!(late.code == Some(1), "{late:?}");
    asks.until("it is told that somebody was not let in", |status| status.sessions.refused > 0).await?;
    before.goes_on(20).await?;
    for session in sessions {
        v2x_common::net::session::close(session).await?;
    }
    asks.until("there are places again", |status| status.sessions.total < MOST - 3).await?;
    let again = support::run(&secured.folder, &[&["status", "--wait", "60"], &at[..]].concat()).await?;
    ensure!(again.code == Some(0), "{again:?}");
    before.goes_on(5).await
}
