//! A hub is killed and started again, or stopped for a while.

use crate::support::{Lab, foreign_session, rests_on, signal, standing};
use serde_json::json;
use std::collections::BTreeSet;
use std::time::Duration;
use v2x_common::clock;
use v2x_common::fused::FusedFrame;
use v2x_common::id::{AgentId, TrackId};
use v2x_common::time::Span;
use v2x_common::wire::ENCODING_JSON;

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
    let restarted_at = clock::now();
    let hub = lab.hub_at(&locator).await?;
    assert_eq!(hub.locator, locator);
    // The same consumer; it gets no notice of the restart.
    let mut first_list = None;
    let after = watch.until("both agents are fused by the second hub", |frame| {
        if frame.lineage == before.lineage {
            first_tracks.extend(tracks(frame));
            return false;
        }
        first_list.get_or_insert(frame.fused_at);
        assert!(first_tracks.is_disjoint(&tracks(frame).collect()), "a track id came back");
        is_fused(frame)
    });
    let after = after.await?;
    let took = first_list.map(|at| at - restarted_at);
    assert!(took.is_some_and(|took| took <= Span::from_millis(2_000)), "{took:?} to the first list");
    assert!(after.lineage > before.lineage);
    assert!(after.fused_at > before.fused_at);
    let is_on_roster =
        |status: &_| ["ego", "rsu"].iter().all(|id| standing(status, id).is_some_and(|agent| agent.alive));
    watch.status_when("both agents are on the second hub's roster", is_on_roster).await?;
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn after_a_stop_of_five_seconds_as_without_a_restart_a_hub_has_the_ids_of_what_is_still_there()
-> anyhow::Result<()> {
    let lab = Lab::new("hub-stopped")?;
    let hub = lab.hub().await?;
    let watch = lab.watch(&hub).await?;
    let session = foreign_session(&hub).await?;
    let key = lab.keys().detections(&AgentId::new("camera")?);
    // A camera sees five parked cars, and goes on while the hub does not.
    let camera = tokio::spawn(async move {
        let mut every = tokio::time::interval(Duration::from_millis(100));
        loop {
            every.tick().await;
            let cars = (0..5).map(|i| json!({ "class": "car", "x": 20 * i, "y": 3 })).collect::<Vec<_>>();
            let frame = json!({ "captured_at": clock::now().as_micros(), "detections": cars }).to_string();
            if session.put(&key, frame).encoding(ENCODING_JSON).await.is_err() {
                return;
            }
        }
    });
    let before = watch.until("five cars are listed", |frame| frame.objects.len() == 5).await?;
    signal(&hub, "-STOP")?;
    tokio::time::sleep(Duration::from_secs(5)).await;
    signal(&hub, "-CONT")?;
    let goes_on_at = clock::now();
    let ids: BTreeSet<_> = tracks(&before).collect();
    let is_heard = |frame: &FusedFrame| {
        // Until the camera is connected again nothing may be listed, but nothing under another id.
        assert!(tracks(frame).all(|id| ids.contains(&id)), "{:?}", tracks(frame).collect::<Vec<_>>());
        frame.objects.len() == 5 && frame.agents.iter().any(|agent| agent.newest_captured_at > goes_on_at)
    };
    let after = watch.until("the camera is heard again", is_heard).await?;
    assert_eq!(after.lineage, before.lineage);
    camera.abort();
    Ok(())
}

fn tracks(frame: &FusedFrame) -> impl Iterator<Item = TrackId> {
    frame.objects.iter().map(|object| object.track)
}
