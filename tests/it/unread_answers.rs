//! Whoever asks a hub and reads none of its answers stops nobody else.

use crate::support::{Lab, PATIENCE, foreign_session, rests_on};
use anyhow::{Context, anyhow, ensure};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket};
use tokio_util::sync::CancellationToken;
use v2x_common::id::{AgentId, HubId};
use v2x_common::net::session::{self, SessionOptions};
use v2x_common::time::Span;
use v2x_fusion_hub::hub::HubStatus;

/// Agents that make a status of some hundred kilobytes.
const CROWD: usize = 400;
/// More answers than sockets and queues hold.
const QUERIES: u64 = 600;
/// Zenoh waits for three seconds and more for one who does not read; a machine may be busy.
const LONGEST_GAP: Span = Span::from_millis(2_000);
/// Longer than Zenoh waits.
const MEANWHILE: Span = Span::from_millis(6_000);

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_queries_by_one_who_reads_no_answer_is_a_fault_that_costs_nobody_a_list()
-> anyhow::Result<()> {
    let lab = Lab::new("unread-answers")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _ego = lab.agent("ego", &hub).await?;
    watch.until("ego is fused", |frame| rests_on(frame, "ego")).await?;
    let crowd = foreign_session(&hub).await?;
    let mut tokens = Vec::new();
    for k in 0..CROWD {
        let token =
            crowd.liveliness().declare_token(lab.keys().agent_alive(&AgentId::new(&format!("a{k}"))?));
        tokens.push(token.await.map_err(|error| anyhow!("{error}"))?);
    }
    watch.status_when("the crowd is known", |status| status.agents.len() > CROWD).await?;

    let (endpoint, frozen) = relay_to(&hub.locator).await?;
    let options = SessionOptions { connect: vec![endpoint], ..Default::default() };
    let session = session::open(session::client_config(&options)?).await?;
    frozen.cancel();
    let answered = Arc::new(AtomicU64::new(0));
    for _ in 0..QUERIES {
        let answered = answered.clone();
        let query = session.get(lab.keys().status(&HubId::new("hub")?)).timeout(Duration::from_secs(60));
        let query = query.callback(move |reply| {
            answered.fetch_add(u64::from(reply.result().is_ok()), Ordering::Relaxed);
        });
        query.await.map_err(|error| anyhow!("{error}"))?;
    }
    let mut before = watch.next().await?.fused_at;
    let until = before + MEANWHILE;
    while before < until {
        let at = watch.next().await?.fused_at;
        ensure!(at - before < LONGEST_GAP, "no list for {}", at - before);
        before = at;
    }
    ensure!(answered.load(Ordering::Relaxed) < QUERIES, "all answers were read");
    let asked = async {
        loop {
            // Until that connection is closed a query gets no answer in time.
            if let Ok(Some(json)) = watch.status_json().await {
                break serde_json::from_value::<HubStatus>(json);
            }
        }
    };
    let status = tokio::time::timeout(PATIENCE, asked).await.context("others are answered")??;
    assert_eq!(status.control.received, status.control.accounted(), "{:?}", status.control);
    Ok(())
}

/// An endpoint that leads to a hub; until it is cancelled, after which nothing of the hub is read any more.
async fn relay_to(locator: &str) -> anyhow::Result<(String, CancellationToken)> {
    let hub: SocketAddr = locator.strip_prefix("tcp/").context("a TCP endpoint")?.parse()?;
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let endpoint = format!("tcp/{}", listener.local_addr()?);
    let frozen = CancellationToken::new();
    let is_frozen = frozen.clone();
    tokio::spawn(async move {
        let (client, _) = listener.accept().await?;
        let socket = TcpSocket::new_v4()?;
        // The kernel reads little ahead.
        socket.set_recv_buffer_size(4096)?;
        let hub = socket.connect(hub).await?;
        let (mut from_client, mut to_client) = client.into_split();
        let (mut from_hub, mut to_hub) = hub.into_split();
        let back = async {
            tokio::select! {
                copied = tokio::io::copy(&mut from_hub, &mut to_client) => copied,
                () = is_frozen.cancelled() => std::future::pending().await,
            }
        };
        tokio::try_join!(tokio::io::copy(&mut from_client, &mut to_hub), back)
    });
    Ok((endpoint, frozen))
}
