//! Two hubs of one name, of which one stands by.

use crate::link::Link;
use crate::support::{Lab, Watch, rests_on, signal};
use anyhow::{Context, ensure};
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;
use v2x_common::clock;
use v2x_common::fused::FusedFrame;
use v2x_common::id::TrackId;
use v2x_common::time::Timestamp;
use v2x_fusion_hub::diagnosis::Code;
use v2x_fusion_hub::hub::{HubStatus, StandbyStatus};
use v2x_lab::loopback::consumer::Traffic;

/// Of the hubs that stand by, or that could.
fn roles(statuses: &[HubStatus]) -> impl Iterator<Item = (&HubStatus, &StandbyStatus)> {
    statuses.iter().filter_map(|status| Some((status, status.standby.as_ref()?)))
}

/// A hub stands by, and knows the ids of all its objects.
fn is_followed(statuses: &[HubStatus]) -> bool {
    roles(statuses).any(|(status, standby)| {
        !standby.publishes && status.objects >= 5 && standby.named_by_another >= status.objects
    })
}

fn ids(list: &FusedFrame) -> BTreeSet<TrackId> {
    list.objects.iter().map(|object| object.track).collect()
}

/// The last list of the hub that published this one, and the first one of the next, whose stamps go on.
async fn change(watch: &Watch, mut last: FusedFrame) -> anyhow::Result<(FusedFrame, FusedFrame)> {
    let first = last.lineage;
    let next = watch.until("another hub publishes", |list| {
        let is_next = list.lineage != first;
        if !is_next {
            last.clone_from(list);
        }
        is_next
    });
    let next = next.await?;
    assert!(next.fused_at > last.fused_at, "{} {}", next.fused_at, last.fused_at);
    Ok((last, next))
}

fn ensure_kept(last: &FusedFrame, next: &FusedFrame) -> anyhow::Result<()> {
    let (before, after) = (ids(last), ids(next));
    let kept = before.intersection(&after).count();
    ensure!(kept * 10 >= before.len() * 9, "{kept} of {}: {before:?} {after:?}", before.len());
    Ok(())
}

/// From now on there are lists of one hub alone.
async fn publishes_alone(watch: &Watch, lineage: u32) -> anyhow::Result<()> {
    let from = clock::now();
    let mut seen = 0;
    let seen_enough = watch.until("enough lists", |list| {
        // Earlier ones may have waited.
        if list.fused_at > from {
            assert_eq!(list.lineage, lineage, "another hub publishes");
            seen += 1;
        }
        seen == 20
    });
    seen_enough.await.map(drop)
}

#[test]
fn lab_takeover_kills_hubs_and_the_standby_publishes_the_same_objects_soon() -> anyhow::Result<()> {
    let lab =
        Command::new(env!("CARGO_BIN_EXE_lab")).args(["takeover", "--times", "2", "--json"]).output()?;
    ensure!(lab.status.success(), "{lab:?}");
    let report: serde_json::Value = serde_json::from_slice(&lab.stdout)?;
    let silent_ms = report["worst_silent_ms"].as_f64().context("a time")?;
    // 300 ms; a list every 100 ms may have come just before.
    ensure!((200.0..1000.0).contains(&silent_ms), "{report}");
    ensure!(report["kept_share"].as_f64().is_some_and(|share| share >= 0.95), "{report}");
    ensure!(report["stamps_back"] == 0, "{report}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hub_that_was_stopped_stands_by_for_its_standby_and_a_recording_of_that_is_computed_again()
-> anyhow::Result<()> {
    let lab = Lab::new("standby-stopped")?;
    let first = lab.standby("first", &[]).await?;
    let recording = lab.folder().join("second.mcap").display().to_string();
    let args = ["--connect", &first.locator, "--record", &recording, "--force"];
    let second = lab.standby("second", &args).await?;
    let _agents = [lab.agent("ego", &second).await?, lab.agent("rsu", &second).await?];
    let watch = lab.watch(&second).await?;
    watch.statuses_when("the second hub follows", is_followed).await?;

    let before = watch.next().await?;
    signal(&first, "-STOP")?;
    let (last, next) = change(&watch, before).await?;
    ensure_kept(&last, &next)?;
    signal(&first, "-CONT")?;
    let stands_by = |statuses: &[HubStatus]| {
        roles(statuses).any(|(status, standby)| {
            status.lineage == last.lineage && standby.follows == Some(next.lineage) && standby.yielded > 0
        })
    };
    watch.statuses_when("the first hub follows", stands_by).await?;
    watch.statuses_when("and knows all ids", is_followed).await?;
    publishes_alone(&watch, next.lineage).await?;

    second.child.end("stopped").await?;
    let retracked = Command::new(env!("CARGO_BIN_EXE_lab")).args(["retrack", &recording]).output()?;
    let said = String::from_utf8_lossy(&retracked.stdout);
    ensure!(retracked.status.success() && said.contains("identical"), "{retracked:?}");
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn two_standby_hubs_whose_link_was_lost_both_publish_and_then_the_one_with_the_lower_lineage_yields()
-> anyhow::Result<()> {
    let lab = Lab::new("standby-link")?;
    let first = lab.standby("first", &[]).await?;
    let link = Link::to(&first.locator).await?;
    let second = lab.standby("second", &["--connect", &link.locator]).await?;
    let _agents = [lab.agent("ego", &first).await?, lab.agent("rsu", &second).await?];
    let (at_first, at_second) = (lab.watch(&first).await?, lab.watch(&second).await?);
    at_second.statuses_when("the second hub follows", is_followed).await?;
    let both = |list: &FusedFrame| rests_on(list, "ego") && rests_on(list, "rsu");
    let before = at_second.until("frames cross the link", both).await?;

    link.cut();
    let (last, next) = change(&at_second, before).await?;
    ensure_kept(&last, &next)?;
    let (lower, higher) = (last.lineage, next.lineage);
    assert!(lower < higher, "the second hub was started later");
    let alone = |statuses: &[HubStatus]| {
        roles(statuses).any(|(status, standby)| status.lineage == lower && standby.publishes)
    };
    at_first.statuses_when("the first hub publishes, too", alone).await?;

    link.mend();
    at_first.until("it yields", |list| list.lineage == higher).await?;
    at_first.until("frames cross the link again", |list| list.lineage == higher && both(list)).await?;
    let yielded = |statuses: &[HubStatus]| {
        let first = roles(statuses).find(|(status, _)| status.lineage == lower);
        statuses.len() == 2 && first.is_some_and(|(_, standby)| standby.follows == Some(higher))
    };
    at_second.statuses_when("it follows", yielded).await?;
    publishes_alone(&at_second, higher).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_standby_with_another_lag_finds_that_its_settings_differ() -> anyhow::Result<()> {
    let lab = Lab::new("standby-differs")?;
    let first = lab.standby("first", &[]).await?;
    let watch = lab.watch(&first).await?;
    let other = Lab::with_settings("standby-differs", "lag_ms = 200\n")?;
    let _second = other.standby("second", &["--connect", &first.locator]).await?;
    let is_found = |statuses: &[HubStatus]| {
        let stands_by = roles(statuses).find(|(_, standby)| !standby.publishes);
        stands_by.is_some_and(|(status, _)| {
            status.findings.iter().any(|one| one.code == Code::StandbyDiffers && one.is_fault())
        })
    };
    watch.statuses_when("it is found", is_found).await.map(drop)
}

/// The ids of the tiles of one list, of the newest list before another hub's and of the first one after.
async fn change_of_tiles(area: &Watch, lineage: u32) -> anyhow::Result<[BTreeSet<TrackId>; 2]> {
    let mut lists: BTreeMap<(u32, u64), (Timestamp, BTreeSet<TrackId>)> = BTreeMap::new();
    let mut stamps = Vec::new();
    // Two lists of the next hub: all tiles of the first one have come then.
    let mut of_next = BTreeSet::new();
    area.until("the next hub's tiles come", |tile| {
        let (_, ids) =
            lists.entry((tile.lineage, tile.sequence)).or_insert_with(|| (tile.fused_at, BTreeSet::new()));
        ids.extend(tile.objects.iter().map(|object| object.track));
        stamps.push(tile.fused_at);
        if tile.lineage != lineage {
            of_next.insert(tile.sequence);
        }
        of_next.len() == 2
    })
    .await?;
    ensure!(stamps.is_sorted(), "stamps of tiles go back: {stamps:?}");
    let last = lists.iter().rfind(|((of, _), _)| *of == lineage).context("no tile of the first hub")?;
    let next = lists.iter().find(|((of, _), _)| *of != lineage).context("no tile of the next hub")?;
    Ok([last.1.1.clone(), next.1.1.clone()])
}

#[tokio::test(flavor = "multi_thread")]
async fn the_second_list_and_the_tiles_go_on_with_their_ids_after_a_standby_has_taken_over()
-> anyhow::Result<()> {
    let lines = "lagged = { lag_ms = 500 }\ntiles = { latitude_deg = 48.137, longitude_deg = 11.575 }\n";
    let lab = Lab::with_settings("standby-parts", lines)?;
    let first = lab.standby("first", &[]).await?;
    let second = lab.standby("second", &["--connect", &first.locator]).await?;
    let _agents = [lab.agent("ego", &second).await?, lab.agent("rsu", &second).await?];
    let live = lab.watch(&second).await?;
    let lagged = lab.watch_lists(&second, Traffic::Lagged).await?;
    // Munich, and a part of it that is larger than the crossing.
    let area = lab.watch_lists(&second, Traffic::Area("120230002213".parse()?)).await?;
    live.statuses_when("the second hub follows", is_followed).await?;
    let before = lagged.until("the second list comes", |list| list.objects.len() >= 5).await?;
    let of_first = live.next().await?.lineage;
    ensure!(before.lineage == of_first, "both are of the first hub");
    area.until("tiles come", |tile| tile.lineage == of_first && !tile.objects.is_empty()).await?;

    signal(&first, "-KILL")?;
    let (last, next) = change(&lagged, before).await?;
    ensure_kept(&last, &next)?;
    let [before, after] = change_of_tiles(&area, of_first).await?;
    let kept = before.intersection(&after).count();
    ensure!(!before.is_empty() && kept * 10 >= before.len() * 9, "{kept}: {before:?} {after:?}");
    // And they go on.
    let from = next.sequence;
    lagged.until("more of the second list", |list| list.sequence >= from + 5).await.map(drop)
}
