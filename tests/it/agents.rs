//! Agents that join, leave and return.

use crate::support::{Lab, health, rests_on, standing};

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
async fn a_killed_agent_is_removed_and_returns_with_a_new_epoch() -> anyhow::Result<()> {
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
