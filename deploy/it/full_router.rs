//! A Zenoh router between all others, whose queues to consumers that take nothing are full.
//!
//! The router is a process of its own: a hub of another network, which relays as any Zenoh router does.

use crate::support::{TIMEOUT, V2x, folder, run, send};
use anyhow::{Context, anyhow, ensure};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;
use v2x_common::net::session::{self, SessionOptions};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;

const NETWORK: &str = "fault-router";
/// More than sockets, queues and a link's buffers hold: what has passed the router while a consumer took nothing.
const MORE_THAN_QUEUES_HOLD: u64 = 64 << 20;
/// Bytes of one message that fills queues.
const LARGE: usize = 64 << 10;
/// Bytes that come back over a slow link in a fiftieth of a second.
const BYTES_BACK: usize = 1_000;
/// The longest time between two lists, µs; a machine may be busy.
const LONGEST_GAP_US: i64 = 3_000_000;
/// Lists that a consumer gets meanwhile.
const MEANWHILE: usize = 100;

async fn client(endpoint: &str) -> anyhow::Result<Session> {
    let options = SessionOptions { connect: vec![endpoint.to_owned()], ..SessionOptions::default() };
    session::open(session::client_config(&options)?).await
}

/// A link to the router over which little comes back: its queue to whoever is behind it is always full.
struct SlowLink {
    endpoint: String,
    relay: JoinHandle<anyhow::Result<()>>,
}

impl SlowLink {
    async fn to(router: &str) -> anyhow::Result<Self> {
        let router = router.strip_prefix("tcp/").context("no TCP")?.to_owned();
        let listener = TcpListener::bind("127.0.0.1:0").await?;
        let endpoint = format!("tcp/{}", listener.local_addr()?);
        let relay = tokio::spawn(async move {
            let (consumer, _) = listener.accept().await?;
            let (mut from_consumer, mut to_consumer) = consumer.into_split();
            let (mut from_router, mut to_router) = TcpStream::connect(router).await?.into_split();
            let there = async { tokio::io::copy(&mut from_consumer, &mut to_router).await };
            let back = async {
                let mut pace = tokio::time::interval(Duration::from_millis(20));
                let mut buffer = [0; BYTES_BACK];
                loop {
                    pace.tick().await;
                    match from_router.read(&mut buffer).await? {
                        0 => return Ok(0),
                        count => to_consumer.write_all(&buffer[..count]).await?,
                    }
                }
            };
            tokio::try_join!(there, back)?;
            Ok(())
        });
        Ok(Self { endpoint, relay })
    }
}

impl Drop for SlowLink {
    fn drop(&mut self) {
        self.relay.abort();
    }
}

/// Somebody whose large messages everybody gets who subscribes to everything, and one who counts them.
struct Flood {
    passed: Arc<AtomicU64>,
    _reader: (Session, Subscriber<()>),
    sends: JoinHandle<()>,
}

impl Flood {
    async fn through(endpoint: &str) -> anyhow::Result<Self> {
        let passed = Arc::new(AtomicU64::new(0));
        let (reader, count) = (client(endpoint).await?, passed.clone());
        let subscriber = reader.declare_subscriber("flood/**").callback(move |sample| {
            count.fetch_add(sample.payload().len() as u64, Ordering::Relaxed);
        });
        let subscriber = subscriber.await.map_err(|error| anyhow!("{error}"))?;
        let sender = client(endpoint).await?;
        let sends = tokio::spawn(async move {
            let large = vec![7_u8; LARGE];
            let mut pace = tokio::time::interval(Duration::from_millis(2));
            loop {
                pace.tick().await;
                let put =
                    sender.put("flood/large", large.clone()).congestion_control(CongestionControl::Drop);
                if put.await.is_err() {
                    return;
                }
            }
        });
        Ok(Self { passed, _reader: (reader, subscriber), sends })
    }

    /// Until so much has passed the router from now on.
    async fn passes(&self, bytes: u64) -> anyhow::Result<()> {
        let until = self.passed.load(Ordering::Relaxed) + bytes;
        let mut poll = tokio::time::interval(Duration::from_millis(20));
        let passed = async {
            while self.passed.load(Ordering::Relaxed) < until {
                poll.tick().await;
            }
        };
        let passed = tokio::time::timeout(TIMEOUT, passed).await;
        passed.map_err(|_| anyhow!("only {} bytes have passed", self.passed.load(Ordering::Relaxed)))
    }
}

impl Drop for Flood {
    fn drop(&mut self) {
        self.sends.abort();
    }
}

/// A hub of this network, with these arguments more; and where it listens.
async fn hub(folder: &Path, network: &str, args: &[&str]) -> anyhow::Result<(V2x, String)> {
    let own = ["hub", "--events", "--listen", "tcp/127.0.0.1:0", "--network", network];
    let mut hub = V2x::start(folder, &[&own[..], args].concat())?;
    let ready: Value = serde_json::from_str(&hub.line().await?)?;
    let endpoint = ready["locators"][0].as_str().context("no locator")?.to_owned();
    Ok((hub, endpoint))
}

/// Accepted frames and descriptions of ego and rsu, by the hub's status.
async fn accepted(folder: &Path, at: &[&str]) -> anyhow::Result<[u64; 2]> {
    let status = run(folder, &[&["status", "--json", "--wait", "20"], at].concat()).await?;
    let status: Value = serde_json::from_str(&status.stdout).with_context(|| format!("{status:?}"))?;
    let agents = status["agents"].as_array().context("agents")?;
    let of = |id: &str| {
        let agent = agents.iter().find(|agent| agent["id"] == id && agent["alive"] == true);
        agent.and_then(|agent| agent["accepted"].as_u64()).unwrap_or(0)
    };
    Ok([of("ego"), of("rsu")])
}

#[tokio::test(flavor = "multi_thread")]
async fn a_router_whose_queues_to_slow_and_stopped_consumers_are_full_is_a_fault_that_stops_no_agent_hub_or_consumer()
-> anyhow::Result<()> {
    let folder = folder("fault-router")?;
    let (_router, router) = hub(&folder, "relay", &["--id", "relay"]).await?;
    let (_hub, _) = hub(&folder, NETWORK, &["--connect", &router]).await?;
    let at = ["--network", NETWORK, "--connect", &router];
    let agent =
        |id| V2x::start(&folder, &[&["agent", "--scenario", "crossing", "--id", id], &at[..]].concat());
    let _agents = [agent("ego")?, agent("rsu")?];
    let watch = ["watch", "--json"];
    // Lists come before anything is full.
    let first = run(&folder, &[&watch[..], &["--count", "20"], &at[..]].concat()).await?;
    ensure!(first.code == Some(0), "{first:?}");

    // They get everything, the flood included: one is slow, and one is stopped.
    let slow = SlowLink::to(&router).await?;
    let check = ["check", "--duration", "600", "--json", "--network", NETWORK, "--wait", "30", "--connect"];
    let _slow = V2x::start(&folder, &[&check[..], &[&slow.endpoint]].concat())?;
    let stopped = V2x::start(&folder, &[&check[..], &[&router]].concat())?;
    let flood = Flood::through(&router).await?;
    flood.passes(MORE_THAN_QUEUES_HOLD / 8).await?;
    send("STOP", stopped.process_id()?).await?;
    flood.passes(MORE_THAN_QUEUES_HOLD).await?;

    let before = accepted(&folder, &at).await?;
    let count = MEANWHILE.to_string();
    let ending = run(&folder, &[&watch[..], &["--count", &count], &at[..]].concat()).await?;
    ensure!(ending.code == Some(0), "{ending:?}");
    let lists: Vec<Value> = ending.stdout.lines().map(serde_json::from_str).collect::<Result<_, _>>()?;
    ensure!(lists.len() == MEANWHILE && lists.iter().all(|list| list["objects"].is_array()));
    let times: Vec<_> = lists.iter().filter_map(|list| list["fused_at"].as_i64()).collect();
    let gap_us = times.windows(2).map(|pair| pair[1] - pair[0]).max().context("times")?;
    ensure!(gap_us < LONGEST_GAP_US, "{gap_us} µs without a list");
    let after = accepted(&folder, &at).await?;
    // Each sends ten a second, and a list comes ten times a second.
    for (before, after) in before.into_iter().zip(after) {
        ensure!(before > 0 && after >= before + MEANWHILE as u64 / 4, "{before} and {after} frames accepted");
    }
    // The flood has not ended meanwhile.
    flood.passes(MORE_THAN_QUEUES_HOLD / 8).await?;
    send("CONT", stopped.process_id()?).await?;
    Ok(())
}
