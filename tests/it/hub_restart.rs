//! A hub is killed and started again.

use crate::support::{Lab, rests_on, standing};
use std::collections::BTreeSet;
use v2x_common::fused::FusedFrame;
use v2x_common::id::TrackId;

#[tokio::test(flavor = "multi_thread")]
async fn after_a_restart_of_the_hub_all_clients_reconnect_and_no_track_id_is_reused() -> anyhow::Result<()> {
    let lab = Lab::new("hub-restart")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let _agents = [lab.agent("ego", &hub).await?, lab.agent("rsu", &hub).await?];
    let is_fused = |frame: &FusedFrame| rests_on(frame, "ego") && rests_on(frame, "rsu");
    let mut first_tracks = BTreeSet::new();
    let before = watch.until("both agents are fused", |frame| {
        first_tracks.extend(tracks(frame));
        is_fused(frame)
    });
    let before = before.await?;

    let locator = hub.locator;
    hub.child.kill().await?;
    let hub = lab.hub_at(&locator).await?;
    assert_eq!(hub.locator, locator);
    // The same consumer; it gets no notice of the restart.
    let after = watch.until("both agents are fused by the second hub", |frame| {
        if frame.lineage == before.lineage {
            first_tracks.extend(tracks(frame));
            return false;
        }
        assert!(first_tracks.is_disjoint(&tracks(frame).collect()), "a track id came back");
        is_fused(frame)
    });
    let after = after.await?;
    assert!(after.lineage > before.lineage);
    assert!(after.fused_at > before.fused_at);
    let is_on_roster =
        |status: &_| ["ego", "rsu"].iter().all(|id| standing(status, id).is_some_and(|agent| agent.alive));
    watch.status_when("both agents are on the second hub's roster", is_on_roster).await?;
    Ok(())
}

fn tracks(frame: &FusedFrame) -> impl Iterator<Item = TrackId> {
    frame.objects.iter().map(|object| object.track)
}
