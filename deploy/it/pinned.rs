//! Clients that believe one hub alone, in a network with two.

use crate::support::{V2x, folder, run, up};
use crate::web::{Events, address};
use anyhow::{Context, ensure};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use v2x_common::keys::Topic;
use v2x_common::recording::Recording;

/// A network with the hubs `hub` and `north`; both list the same objects.
struct Two {
    folder: PathBuf,
    network: &'static str,
    endpoint: String,
    _up: V2x,
    _north: V2x,
}

impl Two {
    async fn start(network: &'static str) -> anyhow::Result<Self> {
        let folder = folder(network)?;
        let (_up, endpoint) = up(&folder, network).await?;
        let args = ["hub", "--id", "north", "--network", network, "--listen", "tcp/127.0.0.1:0", "--events"];
        let mut _north = V2x::start(&folder, &[&args[..], &["--connect", &endpoint]].concat())?;
        ensure!(_north.line().await?.contains("ready"));
        let two = Self { folder, network, endpoint, _up, _north };
        // Until its lists come.
        let ending =
            run(&two.folder, &two.args(&["watch", "--json", "--count", "1", "--hub", "north"])).await?;
        ensure!(ending.code == Some(0), "{ending:#?}");
        Ok(two)
    }

    fn args<'a>(&'a self, args: &[&'a str]) -> Vec<&'a str> {
        [args, &["--network", self.network, "--connect", &self.endpoint]].concat()
    }
}

/// The hubs in a recording, and whether it has what agents say.
fn recorded(path: &Path) -> anyhow::Result<(BTreeSet<String>, bool)> {
    let (mut hubs, mut has_frames) = (BTreeSet::new(), false);
    for entry in Recording::open(path)? {
        let topic = Topic::of(&entry?.key);
        hubs.extend(topic.and_then(|topic| topic.hub()).map(|hub| hub.to_string()));
        has_frames |= matches!(topic, Some(Topic::Detections(_)));
    }
    Ok((hubs, has_frames))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_of_one_hub_holds_its_lists_and_journal_alone_whoever_spoofs_another()
-> anyhow::Result<()> {
    let two = Two::start("pinned-record").await?;
    let north = BTreeSet::from(["north".to_owned()]);
    for command in [&["record", "a.mcap"][..], &["watch", "--record", "b.mcap"]] {
        let args = [command, &["--count", "30", "--hub", "north"]].concat();
        let ending = run(&two.folder, &two.args(&args)).await?;
        ensure!(ending.code == Some(0), "{ending:#?}");
        let file = two.folder.join(command.last().context("a file")?);
        assert_eq!(recorded(&file)?, (north.clone(), true), "{command:?}");
    }
    let ending = run(&two.folder, &two.args(&["record", "c.mcap", "--count", "60"])).await?;
    ensure!(ending.code == Some(0), "{ending:#?}");
    assert_eq!(recorded(&two.folder.join("c.mcap"))?.0.len(), 2, "both without the option");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_live_view_of_one_hub_shows_no_other_hub_whoever_spoofs_another() -> anyhow::Result<()> {
    let two = Two::start("pinned-web").await?;
    let mut watch = V2x::start(&two.folder, &two.args(&["watch", "--web", "0", "--hub", "north"]))?;
    let address = address(&mut watch).await?;
    let mut events = Events::open(&address).await?;
    let mut seen = [0; 3];
    while seen.iter().any(|count| *count < 3) {
        let message = events.next().await?;
        match message["t"].as_str().unwrap_or_default() {
            "fused" => {
                assert_eq!(message["hub"], "north", "{message}");
                seen[0] += 1;
            }
            "status" => {
                let hubs = message["hubs"].as_array().context("hubs")?;
                assert!(hubs.iter().all(|hub| hub["hub"] == "north") && hubs.len() <= 1, "{message}");
                seen[1] += usize::from(!hubs.is_empty());
            }
            "presence" => {
                assert!(
                    message["hubs"] == serde_json::json!(["north"])
                        || message["hubs"] == serde_json::json!([])
                );
                seen[2] = 3;
            }
            _ => {}
        }
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_check_or_a_status_of_one_hub_asks_no_other_one_whoever_spoofs_another() -> anyhow::Result<()> {
    let two = Two::start("pinned-check").await?;
    let args = ["check", "--hub", "north", "--duration", "1", "--json"];
    let ending = run(&two.folder, &two.args(&args)).await?;
    let report: serde_json::Value =
        serde_json::from_str(&ending.stdout).with_context(|| format!("{ending:#?}"))?;
    let hubs: Vec<_> = report["hubs"].as_array().context("hubs")?.iter().map(|hub| &hub["hub"]).collect();
    assert_eq!(hubs, ["north"]);
    let ending = run(&two.folder, &two.args(&["status", "--json", "--hub", "north"])).await?;
    let status: serde_json::Value =
        serde_json::from_str(&ending.stdout).with_context(|| format!("{ending:#?}"))?;
    assert_eq!(status["hub"], "north");
    Ok(())
}
