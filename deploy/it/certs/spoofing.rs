//! Those who are let in say only what they may say.

use super::network::{Secured, denied, keys};
use anyhow::{Context, anyhow};
use serde_json::json;
use v2x_common::clock;
use v2x_common::id::{AgentId, HubId};
use v2x_common::wire::{self, ENCODING_JSON, ENCODING_POSTCARD};
use v2x_fusion_hub::diagnosis::{Code, Finding};
use v2x_fusion_hub::hub::HubStatus;
use zenoh::Session;

/// Puts a sample, whatever becomes of it.
async fn put(session: &Session, key: &str, encoding: &str, payload: Vec<u8>) -> anyhow::Result<()> {
    session.put(key, payload).encoding(encoding).await.map_err(|error| anyhow!("{error}"))
}

/// A frame of an agent with one car, of a boot in the future: its sequence numbers would silence the real one.
fn fake_detections() -> Vec<u8> {
    let frame = json!({
        "captured_at": clock::now().as_micros(), "epoch": u64::MAX.to_string(), "sequence": u64::MAX.to_string(),
        "detections": [{ "class": "car", "x": 500.0, "y": 500.0 }],
    });
    frame.to_string().into_bytes()
}

#[tokio::test(flavor = "multi_thread")]
async fn an_agent_that_spoofs_others_is_denied_by_the_acl_and_the_rest_goes_on() -> anyhow::Result<()> {
    let secured = Secured::start("acl-spoof", &[["agent", "eve"]]).await?;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;
    let (ego, ghost, hub) = (AgentId::new("ego")?, AgentId::new("ghost")?, HubId::new("hub")?);
    let true_frame = watch.next().await?;

    let eve = secured.session("agent/eve").await?;
    let queryable = eve.declare_queryable(keys().status(&hub)).callback(|query| {
        let fake = json!({ "hub": "hub", "fake": true }).to_string();
        drop(zenoh::Wait::wait(query.reply(query.key_expr().clone(), fake)));
    });
    let _queryable = queryable.await.map_err(|error| anyhow!("{error}"))?;
    let token = eve.liveliness().declare_token(keys().agent_alive(&ghost)).await;
    let _token = token.map_err(|error| anyhow!("{error}"))?;
    let mut fake_list = true_frame.clone();
    fake_list.lineage = 666;
    let mut fake_bytes = Vec::new();
    wire::fused::encode(&fake_list, &mut fake_bytes)?;
    let attacked = [
        (keys().detections(&ego), ENCODING_JSON, fake_detections()),
        (keys().sensor(&ego), ENCODING_JSON, b"{}".to_vec()),
        (keys().detections(&ghost), ENCODING_JSON, fake_detections()),
        (keys().all_detections(), ENCODING_JSON, fake_detections()),
        (keys().fused(&hub), ENCODING_POSTCARD, fake_bytes),
    ];
    for (key, encoding, payload) in attacked.clone() {
        put(&eve, &key, encoding, payload).await?;
    }
    let eve_denied = |status: &_, action: &str, key: &str| denied(status, "agent:eve", action, key) > 0;
    let counted = watch.until("each attack is counted with its name", |status| {
        attacked.iter().all(|(key, ..)| eve_denied(status, "Put", key))
            && eve_denied(status, "Declare Queryable", &keys().status(&hub))
            && eve_denied(status, "Liveliness Token", &keys().agent_alive(&ghost))
    });
    let status = counted.await?;
    let is_reported = |status: &HubStatus| {
        let of_eve = |one: &&Finding| one.agent.is_some_and(|agent| agent.as_str() == "eve");
        status.findings.iter().filter(of_eve).any(|one| one.code == Code::RefusedByZenoh && one.is_fault())
    };
    watch.until("it is a finding that names eve", is_reported).await?;
    let names: Vec<_> = status.agents.iter().map(|agent| agent.id.as_str()).collect();
    assert_eq!(names, ["ego"], "neither eve nor a ghost is an agent");
    assert!(status.agents[0].refused.is_empty(), "{:?}", status.agents[0].refused);
    let statuses = watch.statuses().await?;
    assert_eq!(statuses.len(), 1, "{statuses:?}");
    assert_eq!(statuses[0]["fake"], json!(null));
    for _ in 0..20 {
        assert_eq!(watch.next().await?.lineage, true_frame.lineage);
    }
    watch.goes_on("ego").await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_that_publishes_is_denied_by_the_acl() -> anyhow::Result<()> {
    let secured = Secured::start("acl-viewer", &[["viewer", "eve"]]).await?;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;
    let eve = secured.session("viewer/eve").await?;
    let key = keys().detections(&AgentId::new("ego")?);
    put(&eve, &key, ENCODING_JSON, fake_detections()).await?;
    let status = watch.until("it is counted", |status| denied(status, "viewer:eve", "Put", &key) > 0).await?;
    assert!(status.agents[0].refused.is_empty(), "{:?}", status.agents[0].refused);
    watch.goes_on("ego").await
}

#[tokio::test(flavor = "multi_thread")]
async fn an_agent_reads_lists_and_by_the_acl_not_what_other_agents_send() -> anyhow::Result<()> {
    let secured = Secured::start("acl-reading", &[["agent", "eve"]]).await?;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;
    let eve = secured.session("agent/eve").await?;
    let own = eve.declare_subscriber(keys().all_fused()).await.map_err(|error| anyhow!("{error}"))?;
    let of_others =
        eve.declare_subscriber(keys().all_detections()).await.map_err(|error| anyhow!("{error}"))?;
    let listed = tokio::time::timeout(crate::support::TIMEOUT, own.recv_async()).await.context("no list")?;
    listed.map_err(|error| anyhow!("{error}"))?;
    watch.goes_on("ego").await?;
    assert!(of_others.try_recv().map_err(|error| anyhow!("{error}"))?.is_none());
    Ok(())
}

/// What marks a spoofed sample, whatever becomes of its payload.
const MARK: &str = "spoof";
/// So many attempts each time; more with `V2X_SPOOFS`.
const SPOOFS: usize = 3_000;

/// Keys under which somebody could speak for others, or for all, by one of many numbers.
fn spoofed_key(n: usize) -> String {
    let agent = ["ego", "rsu", "ghost", "*", "**", "e*"][n % 6].replace("e*", "e$*");
    let hub = ["hub", "north", "*", "**"][n / 6 % 4];
    let rest = [
        format!("agent/{agent}/detections"),
        format!("agent/{agent}/sensor"),
        format!("agent/{agent}/alive"),
        format!("sim/truth/{agent}"),
        "sim/world".to_owned(),
        format!("hub/{hub}/fused"),
        format!("hub/{hub}/fused/json"),
        format!("hub/{hub}/fused/lagged"),
        format!("hub/{hub}/fused/delta"),
        format!("hub/{hub}/fused/tile/1/2/0"),
        format!("hub/{hub}/journal"),
        format!("hub/{hub}/status"),
        "**".to_owned(),
    ];
    let network = ["demo", "*"][n / 24 % 2];
    format!("v2x/{network}/{}", rest[n / 48 % rest.len()])
}

/// Answers come after everything that was sent before the question, on the same link.
async fn asks(session: &Session) -> anyhow::Result<()> {
    let replies = session.get(keys().all_status()).await.map_err(|error| anyhow!("{error}"))?;
    let answer = tokio::time::timeout(crate::support::TIMEOUT, replies.recv_async()).await;
    answer.context("no answer")?.map(drop).map_err(|error| anyhow!("{error}"))
}

/// It prints how many there were.
#[tokio::test(flavor = "multi_thread")]
async fn none_of_thousands_of_spoofed_samples_under_tls_reaches_a_hub_or_a_consumer() -> anyhow::Result<()> {
    use std::sync::atomic::{AtomicU64, Ordering};
    let count = std::env::var("V2X_SPOOFS").ok().and_then(|text| text.parse().ok()).unwrap_or(SPOOFS);
    let secured =
        Secured::start("spoof-many", &[["agent", "eve"], ["agent", "rsu"], ["viewer", "spy"]]).await?;
    let _agents = [secured.agent("ego")?, secured.agent("rsu")?];
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;
    watch.goes_on("rsu").await?;
    let screen = secured.session("viewer/screen").await?;
    let accepted = std::sync::Arc::new(AtomicU64::new(0));
    let counted = accepted.clone();
    let everything = screen.declare_subscriber("**").callback(move |sample| {
        let is_spoofed = sample.attachment().is_some_and(|mark| mark.to_bytes() == MARK.as_bytes());
        counted.fetch_add(u64::from(is_spoofed), Ordering::Relaxed);
    });
    let _everything = everything.await.map_err(|error| anyhow!("{error}"))?;
    let attackers = [secured.session("agent/eve").await?, secured.session("viewer/spy").await?];
    let mut attempts = 0;
    for n in 0..count {
        for attacker in &attackers {
            let key = spoofed_key(n);
            let sent = if n % 10 == 9 {
                attacker.delete(&key).attachment(MARK).await
            } else {
                attacker.put(&key, fake_detections()).encoding(ENCODING_JSON).attachment(MARK).await
            };
            sent.map_err(|error| anyhow!("{key}: {error}"))?;
            attempts += 1;
            if attempts % 200 == 0 {
                asks(attacker).await?;
            }
        }
    }
    for attacker in &attackers {
        asks(attacker).await?;
    }
    watch.goes_on("ego").await?;
    watch.goes_on("rsu").await?;
    asks(&screen).await?;
    let status = watch.until("the hub knows of them", |status| status.refused_by_zenoh.messages > 0).await?;
    let reached = accepted.load(Ordering::Relaxed);
    println!(
        "{attempts} spoofed samples under TLS, {reached} accepted; the hub denied {}, all others did not leave their sender",
        status.refused_by_zenoh.messages
    );
    assert_eq!(reached, 0, "a consumer got some");
    for agent in &status.agents {
        assert!(["ego", "rsu"].contains(&agent.id.as_str()), "{} is an agent", agent.id);
        assert!(agent.refused.is_empty(), "{}: {:?}", agent.id, agent.refused);
    }
    assert_eq!(status.refused_unnamed, 0, "{:?}", status.invalid_names);
    for _ in 0..10 {
        let list = watch.next().await?;
        let far = list.objects.iter().find(|object| object.bev.x > 400.0 && object.bev.y > 400.0);
        assert!(far.is_none() && list.lineage == status.lineage, "{far:?}");
    }
    Ok(())
}
