//! Several networks at the same time.

use crate::support::{Lab, Watch, foreign_session, rests_on, standing};
use v2x_common::fused::FusedFrame;
use v2x_common::wire;
use v2x_fusion_hub::diagnosis::Code;
use v2x_fusion_hub::hub::{HubStatus, Verdict};
use zenoh::Wait;

/// Number of fused frames in which an agent of the other network would appear.
const FRAMES: usize = 30;

#[tokio::test(flavor = "multi_thread")]
async fn two_hubs_on_different_ports_do_not_find_each_other_even_under_one_name() -> anyhow::Result<()> {
    let lab = Lab::new("two-ports")?;
    let (first, second) = (lab.hub().await?, lab.hub().await?);
    assert_ne!(first.locator, second.locator);
    let (at_first, at_second) = (lab.watch(&first).await?, lab.watch(&second).await?);
    let _agents = [lab.agent("ego", &first).await?, lab.agent("rsu", &second).await?];
    each_sees_only_its_own(&at_first, &at_second).await
}

#[tokio::test(flavor = "multi_thread")]
async fn two_networks_on_one_router_do_not_see_each_other() -> anyhow::Result<()> {
    let lab = Lab::new("one-router")?;
    let sibling = lab.sibling("one-router-sibling")?;
    let router = lab.hub().await?;
    let _second_hub = sibling.hub_joined_to(&router).await?;
    // All hubs and agents are connected to the same router.
    let (at_first, at_second) = (lab.watch(&router).await?, sibling.watch(&router).await?);
    let _agents = [lab.agent("ego", &router).await?, sibling.agent("rsu", &router).await?];
    each_sees_only_its_own(&at_first, &at_second).await
}

/// `ego` is in the first network, `rsu` in the second.
async fn each_sees_only_its_own(first: &Watch, second: &Watch) -> anyhow::Result<()> {
    first.until("ego is fused", |frame| rests_on(frame, "ego")).await?;
    second.until("rsu is fused", |frame| rests_on(frame, "rsu")).await?;
    for (watch, own) in [(first, "ego"), (second, "rsu")] {
        let mut seen = 0;
        let all_seen = watch.until("enough frames", |frame| {
            assert!(frame.agents.iter().all(|health| health.agent.as_str() == own), "{:?}", frame.agents);
            seen += usize::from(rests_on(frame, own));
            seen == FRAMES
        });
        let last = all_seen.await?;
        let status = watch.status_when("a roster", |status| standing(status, own).is_some()).await?;
        assert_eq!(status.lineage, last.lineage, "the answer is of the hub that fused");
        assert_eq!(status.agents.len(), 1, "{:?}", status.agents);
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_hub_of_one_name_that_joins_by_its_zenoh_configuration_is_a_fault_and_does_not_begin()
-> anyhow::Result<()> {
    let lab = Lab::new("one-name-configured")?;
    let hub = lab.hub().await?;
    let config = lab.folder().join("joining.json5");
    // As `v2x certs` writes it: a hub alone waits for nobody.
    let text = format!(
        "{{ mode: \"router\", listen: {{ endpoints: [\"tcp/127.0.0.1:0\"] }}, connect: {{ endpoints: [{:?}] }}, \
         scouting: {{ delay: 0, multicast: {{ enabled: false }} }} }}",
        hub.locator
    );
    std::fs::write(&config, text)?;
    assert!(lab.hub_configured_by(&config).await.is_err(), "it is held off");
    let log = std::fs::read_to_string(lab.folder().join("joined-hub.log"))?;
    let words = format!("already runs in this network, at {}", hub.locator);
    assert!(log.contains(&words), "{words:?} is not in {log}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_hub_of_one_name_is_a_fault_and_does_not_begin_and_lists_in_its_name_are_reported()
-> anyhow::Result<()> {
    let lab = Lab::new("one-name")?;
    let hub = lab.hub().await?;
    let refused = lab.hub_joined_to(&hub).await;
    assert!(refused.is_err(), "it is held off");
    let log = std::fs::read_to_string(lab.folder().join("joined-hub.log"))?;
    let words = format!("already runs in this network, at {}", hub.locator);
    assert!(log.contains(&words), "{words:?} is not in {log}");

    let watch = lab.watch(&hub).await?;
    let own = watch.next().await?;
    let session = foreign_session(&hub).await?;
    let mut list = Vec::new();
    wire::fused::encode(&FusedFrame { lineage: 7, ..own.clone() }, &mut list)?;
    let is_reported = |status: &HubStatus| {
        // Again and again: a list is looked into only now and then.
        let put = session.put(lab.keys().fused(&own.hub), list.clone());
        assert!(put.wait().is_ok());
        status.findings.iter().any(|finding| finding.code == Code::TwoHubs)
    };
    let status = watch.status_when("the other list is reported", is_reported).await?;
    assert_eq!((status.verdict, status.lineage), (Verdict::Degraded, own.lineage));
    Ok(())
}
