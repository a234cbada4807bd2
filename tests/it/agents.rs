//! Agents that join, leave and return.

use crate::link::Link;
use crate::support::{Lab, health, rests_on, standing};
use v2x_fusion_hub::hub::HubStatus;

#[tokio::test(flavor = "multi_thread")]
async fn an_agent_that_joins_late_is_fused() -> anyhow::Result<()> {
    let lab = Lab::new("late-joiner")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _ego = lab.agent("ego", &hub).await?;
    let alone = watch.until("ego is fused", |frame| rests_on(frame, "ego")).await?;
    assert_eq!(health(&alone, "rsu"), None, "nothing of rsu before it is started");

    let _rsu = lab.agent("rsu", &hub).await?;
    watch.until("both are fused", |frame| rests_on(frame, "ego") && rests_on(frame, "rsu")).await?;
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_consumer_that_joins_late_receives_the_present_objects() -> anyhow::Result<()> {
    let lab = Lab::new("late-consumer")?;
    let hub = lab.hub().await?;
    let early = lab.watch(&hub).await?;
    let _rsu = lab.agent("rsu", &hub).await?;
    let seen = early.until("rsu is fused", |frame| rests_on(frame, "rsu")).await?;

    let late = lab.watch(&hub).await?;
    let first = late.next().await?;
    assert!(first.sequence > seen.sequence, "a running hub does not begin again for a new consumer");
    assert!(rests_on(&first, "rsu"));
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_killed_agent_is_removed_and_returns_after_its_restart_with_a_new_epoch() -> anyhow::Result<()> {
    let lab = Lab::new("killed-agent")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let ego = lab.agent("ego", &hub).await?;
    let before = watch.until("ego is fused", |frame| rests_on(frame, "ego")).await?;
    let first_epoch = health(&before, "ego").expect("ego was fused").epoch;
    let is_alive = |status: &_| standing(status, "ego").is_some_and(|ego| ego.alive);
    watch.status_when("ego is on the roster", is_alive).await?;

    ego.kill().await?;
    watch.status_when("ego is gone from the roster", |status| !is_alive(status)).await?;

    let _ego = lab.agent("ego", &hub).await?;
    watch
        .until("objects rest on the second life", |frame| {
            let contributors = frame.objects.iter().flat_map(|object| &object.contributors);
            contributors.filter(|measurement| measurement.frame.epoch > first_epoch).count() > 3
        })
        .await?;
    let status = watch.status_when("ego is back on the roster", is_alive).await?;
    let ego = standing(&status, "ego").expect("it is alive");
    assert_eq!(ego.refused.get("duplicate"), None, "a new epoch numbers its frames anew: {:?}", ego.refused);
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn an_agent_whose_link_is_lost_is_a_fault_of_its_own_and_it_is_fused_again_when_the_link_is_back()
-> anyhow::Result<()> {
    let lab = Lab::new("fault-link")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let link = Link::to(&hub.locator).await?;
    let _agents = [lab.agent_at("ego", &link.locator).await?, lab.agent("rsu", &hub).await?];
    watch.until("both are fused", |frame| rests_on(frame, "ego") && rests_on(frame, "rsu")).await?;
    let accepted = |status: &HubStatus, id| standing(status, id).map_or(0, |agent| agent.accepted);

    link.cut();
    let is_gone = |status: &HubStatus| standing(status, "ego").is_some_and(|ego| !ego.alive);
    let lost = watch.status_when("ego is missed", is_gone).await?;
    let goes_on = |status: &HubStatus| accepted(status, "rsu") > accepted(&lost, "rsu") + 20;
    let later = watch.status_when("rsu goes on", goes_on).await?;
    assert_eq!(accepted(&later, "ego"), accepted(&lost, "ego"));

    link.mend();
    let is_back = |status: &HubStatus| {
        standing(status, "ego").is_some_and(|ego| ego.alive)
            && accepted(status, "ego") > accepted(&lost, "ego") + 20
    };
    watch.status_when("ego is fused again", is_back).await?;
    watch.until("objects rest on it", |frame| rests_on(frame, "ego")).await.map(drop)
}
