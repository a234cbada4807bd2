//! Error messages of the kit contain all details.

use crate::{PATIENCE, PATIENT_HUB};
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use v2x_common::clock;
use v2x_common::time::Span;
use v2x_fusion_hub::hub::HubStatus;
use v2x_lab::loopback::{Actor, Agent, KitError, Network, Script, block_on};

/// Time limit of a wait that must fail. Some fused frames arrive in it, at ten per second.
const SHORT: Duration = Duration::from_millis(500);

#[tokio::test(flavor = "multi_thread")]
async fn a_timeout_reports_the_last_frame_and_refusals_by_agent_and_reason() -> Result<(), KitError> {
    let network = Network::start_with(PATIENT_HUB).await?;
    let (good, stale) = (network.agent("good").join().await?, network.agent("stale").join().await?);
    let script = Script::every(Duration::from_millis(20)).of([Actor::car(12.0, 34.0)]);
    good.play(script)?;
    stale.send_frame(&stale.frame(clock::now() - Span::from_millis(60_000), Vec::new()))?;
    let heard = |status: &HubStatus| {
        status.objects == 1 && status.agents.iter().any(|agent| !agent.refused.is_empty())
    };
    network.await_status(heard, PATIENCE).await?;
    let two = network.await_fused(|fused| fused.objects.len() == 2, SHORT).await;
    let Err(error) = two else { panic!("there is one car: {two:?}") };
    let KitError::TimedOut { patience, seen } = &error else { panic!("{error}") };
    assert!(*patience == SHORT && seen.frames > 0 && seen.last.is_some(), "{error}");
    let details =
        ["with 1 objects", "vehicle.car at (1", "of agent good", "of agent stale", "refused 1 as too_late"];
    for words in details {
        assert!(error.to_string().contains(words), "nothing of {words:?} in: {error}");
    }
    // Tests that return the error print it by `Debug`.
    assert_eq!(format!("{error:?}"), error.to_string());
    network.end().await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_timeout_of_a_network_without_agents_reports_that() -> Result<(), KitError> {
    let network = Network::start().await?;
    let error =
        network.await_fused(|fused| !fused.objects.is_empty(), SHORT).await.expect_err("there is no agent");
    assert!(error.to_string().contains("received no frame of any agent"), "{error}");
    network.end().await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_names_links_settings_and_frames_are_errors_with_their_name() -> Result<(), KitError> {
    let network = Network::start().await?;
    let message =
        |outcome: Result<Agent, KitError>| outcome.map(|agent| agent.id()).expect_err("refused").to_string();
    let slash = message(network.agent("a/b").join().await);
    assert!(slash.contains("a/b"), "{slash}");
    let link = message(network.agent("cam").over("lte-zz").join().await);
    assert!(link.contains("cam") && link.contains("lte-zz") && link.contains("lte-uu"), "{link}");
    let setting = message(network.agent("cam").over("lte-uu:los=0.1").join().await);
    assert!(setting.contains("los"), "{setting}");

    let cam = network.agent("cam").join().await?;
    let far = Script::every(SHORT).of([Actor::car(1e300, 0.0)]);
    let absurd = cam.play(far).expect_err("no car is there").to_string();
    assert!(absurd.contains("cam") && absurd.contains('x'), "{absurd}");

    for (settings, named) in [("delta_max = 3", "delta_max"), ("gate = -1", "gate"), ("gate =", "TOML")] {
        let outcome = Network::start_with(settings).await.map(|network| network.id());
        let error = outcome.expect_err("refused").to_string();
        assert!(error.contains(named), "{error}");
    }
    network.end().await.map(|_| ())
}

#[tokio::test]
async fn a_runtime_of_one_thread_is_an_error_with_the_fix() {
    let error = Network::start().await.map(|network| network.id()).expect_err("one thread is not enough");
    assert!(matches!(error, KitError::OneThread), "{error}");
    assert!(error.to_string().contains("flavor = \"multi_thread\""), "{error}");
    let error = block_on(async { Ok::<_, KitError>(()) }).expect_err("there is a runtime");
    assert!(matches!(error, KitError::RuntimeInRuntime), "{error}");
}

#[test]
fn a_missing_runtime_is_an_error() {
    let polled = pin!(Network::start()).poll(&mut Context::from_waker(Waker::noop()));
    let Poll::Ready(Err(error)) = polled else { panic!("there is no runtime to wait in") };
    assert!(matches!(error, KitError::NoRuntime) && error.to_string().contains("block_on"), "{error}");
}
