//! The end of a network ends all its tasks, and networks are isolated from each other.

use crate::{PATIENCE, PATIENT_HUB};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;
use v2x_fusion_hub::hub::HubStatus;
use v2x_lab::loopback::{Actor, KitError, Network, Script, block_on};

fn address(network: &Network) -> String {
    network.locator().trim_start_matches("tcp/").to_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn after_the_end_the_port_is_free_and_the_last_status_is_returned() -> Result<(), KitError> {
    let network = Network::start().await?;
    let address = address(&network);
    let camera = network.agent("camera").join().await?;
    let sent = camera.send(Vec::new())?;
    network.await_fused(|fused| crate::inclusion(fused, sent.frame).is_some(), PATIENCE).await?;
    let status = network.end().await?;
    assert_eq!(status.agents.iter().map(|agent| agent.accepted).sum::<u64>(), 1, "{status:?}");
    TcpListener::bind(address).expect("the port is free");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_network_ends_during_a_script() -> Result<(), KitError> {
    let network = Network::start().await?;
    let address = address(&network);
    let camera = network.agent("camera").join().await?;
    camera.play(Script::every(Duration::from_millis(10)).of([Actor::car(0.0, 0.0)]))?;
    drop(network);
    let closed = async {
        while TcpStream::connect(&address).is_ok() {
            tokio::task::yield_now().await;
        }
    };
    tokio::time::timeout(PATIENCE, closed).await.expect("the hub has ended");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn an_agent_that_is_dropped_leaves_and_the_hub_notices() -> Result<(), KitError> {
    let network = Network::start_with(PATIENT_HUB).await?;
    let (stays, goes) = (network.agent("stays").join().await?, network.agent("goes").join().await?);
    for agent in [&stays, &goes] {
        agent.play(Script::every(Duration::from_millis(20)).of([Actor::pedestrian(1.0, 1.0)]))?;
    }
    let statistics = |status: &HubStatus, name: &str| {
        let agent = status.agents.iter().find(|agent| agent.id.as_str() == name);
        agent.map(|agent| (agent.alive, agent.accepted)).unwrap_or_default()
    };
    let both = |status: &_| statistics(status, "stays").1 > 3 && statistics(status, "goes").1 > 3;
    network.await_status(both, PATIENCE).await?;
    drop(goes);
    let left = network.await_status(|status| !statistics(status, "goes").0, PATIENCE).await?;
    let goes_on = |status: &_| statistics(status, "stays").1 > statistics(&left, "stays").1 + 3;
    let last = network.await_status(goes_on, PATIENCE).await?;
    assert!(statistics(&last, "stays").0, "{last:?}");
    network.end().await.map(|_| ())
}

#[test]
fn two_networks_in_one_test_without_a_runtime_are_separate() -> Result<(), KitError> {
    block_on(async {
        let (ours, theirs) = (Network::start().await?, Network::start().await?);
        assert_ne!((ours.id(), ours.locator()), (theirs.id(), theirs.locator()));
        let camera = ours.agent("camera").join().await?;
        let sent = camera.send(Vec::new())?;
        ours.await_fused(|fused| crate::inclusion(fused, sent.frame).is_some(), PATIENCE).await?;
        assert!(theirs.status().await?.agents.is_empty());
        theirs.end().await?;
        ours.end().await.map(|_| ())
    })
}
