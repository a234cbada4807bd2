//! The proxy as a slow link: data comes through it late, complete and in order.

use crate::support::{TIMEOUT, V2x, folder, run};
use anyhow::Context;
use std::path::Path;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use v2x_common::clock;
use v2x_common::time::Span;
use v2x_lab::loopback::Network;

/// A proxy in front of `to`, and its endpoint.
async fn proxy(folder: &Path, to: &str, link: &[&str]) -> anyhow::Result<(V2x, String)> {
    let args = [&["proxy", "--listen", "tcp/127.0.0.1:0", "--to", to, "--link"], link].concat();
    let mut proxy = V2x::start(folder, &args)?;
    let line = proxy.stderr_line("proxy at tcp/").await?;
    let endpoint = line.split_whitespace().find(|word| word.starts_with("tcp/")).context("no endpoint")?;
    Ok((proxy, endpoint.to_owned()))
}

/// Starts a server that sends back what it receives; returns its endpoint.
async fn echo() -> anyhow::Result<String> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let endpoint = format!("tcp/{}", listener.local_addr()?);
    tokio::spawn(async move {
        let (mut stream, _) = listener.accept().await?;
        let (mut from, mut to) = stream.split();
        tokio::io::copy(&mut from, &mut to).await?;
        to.shutdown().await
    });
    Ok(endpoint)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_round_trip_takes_the_delays_of_both_directions() -> anyhow::Result<()> {
    let folder = folder("proxy-round-trip")?;
    let link = ["custom:delay=120ms", "--back", "custom:delay=40ms"];
    let (_proxy, endpoint) = proxy(&folder, &echo().await?, &link).await?;
    let mut stream = TcpStream::connect(endpoint.trim_start_matches("tcp/")).await?;
    let mut trips = Vec::new();
    for byte in 0..10_u8 {
        let begun_at = clock::now();
        stream.write_all(&[byte]).await?;
        assert_eq!(tokio::time::timeout(TIMEOUT, stream.read_u8()).await??, byte);
        trips.push(clock::now() - begun_at);
    }
    // Each is at least that long; the shortest of ten is not much longer on a machine that is busy now and then.
    let shortest = trips.iter().min().context("ten trips")?;
    assert!(*shortest >= Span::from_millis(160) && *shortest < Span::from_millis(240), "{trips:?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn bytes_stay_complete_and_in_order_under_jitter_until_both_directions_are_closed() -> anyhow::Result<()>
{
    let folder = folder("proxy-order")?;
    let link = ["custom:delay=20ms,jitter=20ms,rate=100Mbps"];
    let (mut proxy, endpoint) = proxy(&folder, &echo().await?, &link).await?;
    let mut stream = TcpStream::connect(endpoint.trim_start_matches("tcp/")).await?;
    let sent: Vec<u8> = (0..400_000_u32).flat_map(u32::to_le_bytes).collect();
    let (mut from, mut to) = stream.split();
    let send = async {
        to.write_all(&sent).await?;
        to.shutdown().await
    };
    let mut received = Vec::new();
    let both = async { tokio::try_join!(send, from.read_to_end(&mut received)) };
    tokio::time::timeout(TIMEOUT, both).await.context("the stream does not end")??;
    assert!(received == sent, "{} bytes of {}", received.len(), sent.len());
    let closed = proxy.stderr_line("connection closed").await?;
    assert!(closed.contains(&sent.len().to_string()), "{closed}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_of_an_agent_behind_it_arrive_late() -> anyhow::Result<()> {
    const DELAY: Span = Span::from_millis(150);
    let folder = folder("proxy-zenoh")?;
    let network = Network::start_with("delta_max_ms = 20000").await?;
    let (_proxy, endpoint) = proxy(&folder, network.locator(), &["custom:delay=150ms"]).await?;
    let (near, far) =
        (network.agent("near").join().await?, network.agent("far").through(&endpoint).join().await?);
    let mut ages = Vec::new();
    for agent in [&near, &far] {
        let mut shortest = Span::from_millis(i64::MAX);
        for _ in 0..5 {
            let sent = agent.send(Vec::new())?;
            let contains = |fused: &v2x_common::fused::FusedFrame| {
                let found = fused.includes.iter().find(|inclusion| inclusion.frame == sent.frame);
                shortest =
                    found.map_or(shortest, |found| shortest.min(found.received_at - found.captured_at));
                found.is_some()
            };
            network.await_fused(contains, TIMEOUT).await?;
        }
        ages.push(shortest);
    }
    assert!(ages[0] < DELAY && ages[1] >= DELAY, "{ages:?}");
    assert!(ages[1] - ages[0] < DELAY + Span::from_millis(100), "{ages:?}");
    network.end().await?;
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_with_losses_is_refused_with_the_page_to_read() -> anyhow::Result<()> {
    let folder = folder("proxy-loss")?;
    let ending = run(&folder, &["proxy", "--link", "lte-uu:loss=0.1"]).await?;
    assert_eq!(ending.code, Some(1), "{ending:#?}");
    assert!(ending.stderr.contains("loses nothing") && ending.stderr.contains("deploy/links"), "{ending:#?}");
    Ok(())
}
