//! Who may take part changes while a hub runs.

use super::network::{Secured, accepted, agent, certs, config_of};
use crate::recording::is_identical;
use crate::support::{V2x, send};
use anyhow::ensure;
use std::collections::BTreeSet;
use v2x_fusion_hub::hub::HubStatus;

#[tokio::test(flavor = "multi_thread")]
async fn a_running_hub_follows_new_and_revoked_certs_keeps_its_objects_and_is_recorded_through_that()
-> anyhow::Result<()> {
    let secured = Secured::start("certs-followed", &[]).await?;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    let lineage = watch.until("ego is there", |status| accepted(status, "ego") > 20).await?.lineage;
    let screen = config_of("viewer/screen");
    let record = ["record", "run.mcap", "--zenoh-config", &screen, "--connect", &secured.endpoint];
    let recorder = V2x::start(&secured.folder, &record)?;
    let before: BTreeSet<_> = watch.next().await?.objects.iter().map(|object| object.track).collect();
    assert!(!before.is_empty());

    certs(&secured.folder, &["agent", "rsu"]).await?;
    let mut rsu = secured.agent("rsu")?;
    watch.until("the new agent is let in", |status| accepted(status, "rsu") > 5).await?;

    certs(&secured.folder, &["revoke", "rsu"]).await?;
    let out =
        watch.until("the revoked agent is out", |status| agent(status, "rsu").is_some_and(|rsu| !rsu.alive));
    let out = out.await?;
    // Zenoh does not say it to the agent, which is told of no subscriber any more.
    rsu.stderr_line("nobody reads what this agent sends").await?;
    watch.goes_on("ego").await?;
    let after =
        watch.until("ego goes on", |status| accepted(status, "ego") > accepted(&out, "ego") + 20).await?;
    assert_eq!(accepted(&after, "rsu"), accepted(&out, "rsu"));
    assert_eq!(after.lineage, lineage, "the hub was not restarted");
    let now: BTreeSet<_> = watch.next().await?.objects.iter().map(|object| object.track).collect();
    assert!(before.intersection(&now).count() > 0, "objects keep their ids: {before:?}, {now:?}");
    send("INT", recorder.process_id()?).await?;
    let ending = recorder.end().await?;
    assert_eq!(ending.code, Some(0), "{ending:#?}");
    assert!(
        is_identical(&secured.folder.join("run.mcap"))?,
        "lists while the session was closed are in a gap"
    );
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_whose_tls_certificate_expires_is_closed() -> anyhow::Result<()> {
    let secured = Secured::start("tls-expiring", &[]).await?;
    // Some eight seconds.
    certs(&secured.folder, &["agent", "rsu", "--days", "0.0001"]).await?;
    let _rsu = secured.agent("rsu")?;
    let watch = secured.watch().await?;
    let _ego = secured.agent("ego")?;
    watch.until("it is let in", |status| accepted(status, "rsu") > 0).await?;
    watch.until("it is out", |status| agent(status, "rsu").is_some_and(|rsu| !rsu.alive)).await?;
    watch.goes_on("ego").await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_running_hub_keeps_its_acl_where_the_new_one_cannot_be_used() -> anyhow::Result<()> {
    let mut secured = Secured::start("acl-unusable", &[]).await?;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;
    let path = secured.folder.join(config_of("hub/hub"));
    let good = std::fs::read_to_string(&path)?;
    // Not to be read at all, and with a rule that there is not.
    for bad in [good.replace('}', ""), good.replacen("\"nothing\"", "\"no-such-rule\"", 1)] {
        std::fs::write(&path, bad)?;
        secured.hub.stderr_line("not followed").await?;
        watch.goes_on("ego").await?;
    }
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn certs_that_come_after_their_configuration_are_followed_without_another_change_and_it_shows_until_then()
-> anyhow::Result<()> {
    let secured = Secured::start("certs-late", &[]).await?;
    let _ego = secured.agent("ego")?;
    let watch = secured.watch().await?;
    watch.goes_on("ego").await?;
    let folder = secured.folder.join("certs/hub/hub");
    let (file, late) = (secured.folder.join(config_of("hub/hub")), folder.join("late.pem"));
    let text = std::fs::read_to_string(&file)?;
    let renewed =
        text.replace("\"listen_certificate\": \"certificate.pem\"", "\"listen_certificate\": \"late.pem\"");
    ensure!(renewed != text, "{text}");
    std::fs::write(&late, "half of it")?;
    std::fs::write(&file, renewed)?;
    let is_behind = |status: &HubStatus| {
        status.findings.iter().any(|finding| finding.is_fault() && finding.says.contains("is not followed"))
    };
    watch.until("it shows that the configuration is not followed", is_behind).await?;
    watch.goes_on("ego").await?;
    std::fs::copy(folder.join("certificate.pem"), &late)?;
    watch.until("it is followed", |status| !is_behind(status)).await?;
    watch.goes_on("ego").await
}
