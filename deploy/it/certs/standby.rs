//! A standby with the certificate of the hub for which it stands by.

use super::network::{Secured, config_of, hub};
use crate::support;
use anyhow::ensure;
use std::collections::BTreeSet;

#[tokio::test(flavor = "multi_thread")]
async fn a_standby_with_the_hubs_certificate_is_linked_by_tls_and_takes_over_with_its_ids()
-> anyhow::Result<()> {
    let secured = Secured::start("standby-tls", &[]).await?;
    let args = ["--standby", "--connect", &secured.endpoint, "--zenoh-config", &config_of("hub/hub")];
    let (_standby, endpoint) = hub(&secured.folder, "tls", &args).await?;
    // Its frames reach the first hub over the link, and the lists of that come back.
    let _ego = secured.agent_at(&endpoint, "ego")?;
    let watch = secured.watch_at(&endpoint).await?;
    let followed = |status: &v2x_fusion_hub::hub::HubStatus| {
        let standby = status.standby.as_ref().filter(|standby| !standby.publishes);
        standby.is_some_and(|one| status.objects >= 5 && one.named_by_another >= status.objects)
    };
    let standby = watch.until("it knows the ids of all objects", followed).await?;
    let config = config_of("viewer/screen");
    let args = ["status", "--connect", &endpoint, "--zenoh-config", &config];
    let both = support::run(&secured.folder, &args).await?;
    ensure!(
        both.stdout.contains("stands by for hub ") && both.stdout.matches("network demo").count() == 2,
        "{both:?}"
    );
    let mut last = watch.next().await?;
    ensure!(last.lineage != standby.lineage, "the first hub publishes");
    drop(secured.hub);
    let next = loop {
        let list = watch.next().await?;
        if list.lineage == standby.lineage {
            break list;
        }
        last = list;
    };
    let ids = |list: &v2x_common::fused::FusedFrame| -> BTreeSet<_> {
        list.objects.iter().map(|object| object.track).collect()
    };
    let (before, after) = (ids(&last), ids(&next));
    let kept = before.intersection(&after).count();
    // On a busy machine the last lists come late. What share is kept is measured by `lab takeover`.
    ensure!(kept * 4 >= before.len() * 3, "{kept} of {}: {before:?} {after:?}", before.len());
    Ok(())
}
