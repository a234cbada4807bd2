//! Lists that cost less than the whole one, over a network.

use crate::{PATIENCE, PATIENT_HUB};
use anyhow::{Context, anyhow};
use std::collections::BTreeMap;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::fused::FusedFrame;
use v2x_common::id::HubId;
use v2x_common::keys::{Keys, Topic};
use v2x_common::lists::{AreaFollower, DeltaFollower, ListUpdate, Tolerance};
use v2x_common::net::session::SessionOptions;
use v2x_common::recording::Entry;
use v2x_common::tile::{Geodetic, LocalPlane, Tile, Zoom};
use v2x_common::wire;
use v2x_lab::loopback::consumer::{Consumer, Subscription, Traffic};
use v2x_lab::loopback::{Actor, Network, Noise, Script};

const INTERVAL: Duration = Duration::from_millis(100);
/// Munich: the edges of its tile of zoom 16 are 101 m or more from the origin.
const TILES: &str = "tiles = { latitude_deg = 48.137, longitude_deg = 11.575 }";

/// The tolerance, and what the wire rounds: positions and velocities to 1 mm, probabilities to 1/255, σ up by 4.5 %.
const ROUNDED: Tolerance = Tolerance {
    position_m: Tolerance::HUB.position_m + 2e-3,
    velocity_mps: Tolerance::HUB.velocity_mps + 1e-3,
    size_m: Tolerance::HUB.size_m + 1e-3,
    yaw_rad: Tolerance::HUB.yaw_rad + 1e-4,
    probability: Tolerance::HUB.probability + 1.0 / 255.0,
    variance_factor: Tolerance::HUB.variance_factor * 1.3,
};

async fn consumer(network: &Network, traffic: Traffic) -> anyhow::Result<Consumer> {
    let options = SessionOptions { connect: vec![network.locator().to_owned()], ..SessionOptions::default() };
    let subscription = Subscription { network: network.id(), traffic, hub: None, capacity: 1 << 14 };
    let never = CancellationToken::new();
    let consumer = Consumer::connect(&options, subscription, PATIENCE, &never).await?;
    consumer.context("no shutdown was requested")
}

async fn next(consumer: &Consumer) -> anyhow::Result<Entry> {
    tokio::time::timeout(PATIENCE, consumer.next()).await.context("no sample came")
}

/// Eight cars, half of them parked, reported with noise.
fn traffic() -> Script {
    let cars = (0..8_u8).map(|k| {
        let place = f64::from(k) * 12.0;
        Actor::car(place, place).driving(if k % 2 == 0 { 0.0 } else { place / 4.0 }, 0.0)
    });
    Script::every(INTERVAL).of(cars).with_noise(Noise { position_m: 0.1, ..Noise::default() })
}

/// The whole list with this number, if it comes; those before it are consumed.
async fn whole(network: &Network, sequence: u64) -> anyhow::Result<Option<FusedFrame>> {
    let frame = network.await_fused(|frame| frame.sequence >= sequence, PATIENCE).await?;
    Ok(Some(frame).filter(|frame| frame.sequence == sequence))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_followed_list_is_the_whole_one_within_the_tolerance_with_fewer_objects_sent() -> anyhow::Result<()>
{
    let network = Network::start_with(PATIENT_HUB).await?;
    let camera = network.agent("camera").seed(5).join().await?;
    camera.play(traffic())?;
    network.await_fused(|frame| frame.objects.len() == 8, PATIENCE).await?;
    let deltas = consumer(&network, Traffic::Delta).await?;
    let mut follower = DeltaFollower::default();
    let (mut n_keys, mut n_deltas, mut n_sent, mut n_listed) = (0, 0, 0, 0);
    while n_keys < 3 || n_deltas < 15 {
        let entry = next(&deltas).await?;
        let update = wire::decode_update(&entry.encoding, &entry.payload)?;
        match &update {
            ListUpdate::Key(frame) => {
                n_keys += 1;
                assert!(frame.agents.is_empty() && frame.includes.is_empty());
            }
            ListUpdate::Delta(delta) => (n_deltas, n_sent) = (n_deltas + 1, n_sent + delta.changed.len()),
        }
        assert!(n_keys > 0, "who comes first begins with a key frame");
        let is_delta = matches!(update, ListUpdate::Delta(_));
        let followed = follower.handle(update)?.clone();
        n_listed += if is_delta { followed.objects.len() } else { 0 };
        if let Some(whole) = whole(&network, followed.sequence).await? {
            assert_eq!((followed.fused_at, followed.objects.len()), (whole.fused_at, whole.objects.len()));
            for (taken, live) in followed.objects.iter().zip(&whole.objects) {
                assert_eq!(taken.track, live.track);
                assert!(ROUNDED.allows(taken, live), "{taken:?} is not {live:?}");
                assert!(taken.contributors.is_empty() && !live.contributors.is_empty());
            }
        }
    }
    assert!(2 * n_sent < n_listed, "{n_sent} of {n_listed} objects were sent");
    deltas.close().await?;
    network.end().await?;
    Ok(())
}

fn tile_at(x_m: f64, y_m: f64, zoom: u8) -> Tile {
    let plane = LocalPlane::new(Geodetic { latitude_deg: 48.137, longitude_deg: 11.575 });
    Tile::of(plane.geodetic(x_m, y_m), Zoom::new(zoom).expect("a legal zoom"))
}

#[tokio::test(flavor = "multi_thread")]
async fn an_area_gets_exactly_its_objects_and_an_empty_frame_when_the_last_one_is_gone() -> anyhow::Result<()>
{
    let settings = format!("delta_max_ms = 20000\ncoast_ms = 2000\nbirths = \"at-once\"\n{TILES}");
    let network = Network::start_with(&settings).await?;
    // The area of zoom 14 holds the first two, which are in two tiles of zoom 16; the third is far away.
    let places = [(0.0, 0.0), (-300.0, 0.0), (5000.0, 0.0)];
    let area = tile_at(0.0, 0.0, 14);
    assert_eq!(places.map(|(x, y)| area.contains(tile_at(x, y, 16))), [true, true, false]);
    let tiles = consumer(&network, Traffic::Area(area)).await?;
    let camera = network.agent("camera").join().await?;
    camera.send(
        places
            .map(|(x, y)| Actor::car(x, y).detection(v2x_common::time::Span::ZERO, Noise::default()))
            .to_vec(),
    )?;
    let mut follower = AreaFollower::default();
    let (mut most, mut emptied) = (0, BTreeMap::new());
    while emptied.len() < 2 {
        let entry = next(&tiles).await?;
        let Some(Topic::Tile(_, tile)) = Topic::of(&entry.key) else { panic!("{} is no tile", entry.key) };
        let frame = wire::fused::decode(&entry.payload)?;
        for object in &frame.objects {
            assert_eq!(tile_at(object.bev.x, object.bev.y, 16), tile, "{object:?}");
            assert!(object.bev.x < 1000.0 && object.contributors.is_empty());
        }
        if frame.objects.is_empty() {
            *emptied.entry(tile).or_insert(0) += 1;
        }
        follower.handle(tile, frame)?;
        most = most.max(follower.list().map_or(0, |list| list.objects.len()));
    }
    assert_eq!((most, emptied.into_values().collect::<Vec<_>>()), (2, vec![1, 1]));
    assert!(follower.list().is_some_and(|list| list.objects.is_empty()));
    tiles.close().await?;
    network.end().await?;
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn lists_that_nobody_subscribes_to_are_not_made() -> anyhow::Result<()> {
    let network = Network::start_with(&format!("{PATIENT_HUB}\n{TILES}")).await?;
    let camera = network.agent("camera").join().await?;
    camera.play(traffic())?;
    let published = |status: &v2x_lab::loopback::HubStatus| {
        (status.delta_frames_published > 0, status.tile_frames_published > 0)
    };
    let status = network.await_status(|status| status.frames_published > 20, PATIENCE).await?;
    assert_eq!(published(&status), (false, false));
    let deltas = consumer(&network, Traffic::Delta).await?;
    let status = network.await_status(|status| published(status).0, PATIENCE).await?;
    assert_eq!(published(&status), (true, false));
    let tiles = consumer(&network, Traffic::Area(tile_at(0.0, 0.0, 12))).await?;
    network.await_status(|status| published(status).1, PATIENCE).await?;
    deltas.close().await?;
    tiles.close().await?;
    network.end().await?;
    Ok(())
}

/// The frames of both codecs with their payloads, by number, until each has twenty.
async fn both_codecs(network: &Network) -> anyhow::Result<[BTreeMap<u64, (FusedFrame, Vec<u8>)>; 2]> {
    let whole = consumer(network, Traffic::Fused).await?;
    let key = Keys::new(network.id()).fused_json(&HubId::new("hub")?);
    let json = whole.session().declare_subscriber(key).await.map_err(|error| anyhow!("{error}"))?;
    let mut frames = [BTreeMap::new(), BTreeMap::new()];
    while frames.iter().any(|frames| frames.len() < 20) {
        tokio::select! {
            entry = next(&whole) => {
                let payload = entry?.payload;
                let frame = wire::fused::decode(&payload)?;
                frames[0].insert(frame.sequence, (frame, payload));
            }
            sample = json.recv_async() => {
                let payload = sample.map_err(|error| anyhow!("{error}"))?.payload().to_bytes().into_owned();
                let frame = wire::json::decode_fused(&payload)?;
                frames[1].insert(frame.sequence, (frame, payload));
            }
        }
    }
    drop(json);
    whole.close().await?;
    Ok(frames)
}

#[tokio::test(flavor = "multi_thread")]
async fn subscribers_of_the_whole_list_get_the_same_frames_while_others_follow_parts_of_it()
-> anyhow::Result<()> {
    let network = Network::start_with(&format!("{PATIENT_HUB}\n{TILES}")).await?;
    let camera = network.agent("camera").join().await?;
    camera.play(traffic())?;
    network.await_fused(|frame| frame.objects.len() == 8, PATIENCE).await?;
    let deltas = consumer(&network, Traffic::Delta).await?;
    let tiles = consumer(&network, Traffic::Area(tile_at(0.0, 0.0, 12))).await?;
    let [whole, json] = both_codecs(&network).await?;
    for (frame, payload) in whole.values() {
        let mut again = Vec::new();
        wire::fused::encode(frame, &mut again)?;
        assert_eq!(&again, payload);
        assert!(
            !frame.agents.is_empty() && frame.objects.iter().all(|object| object.contributors.len() == 1)
        );
    }
    let both: Vec<_> = whole.iter().filter_map(|(sequence, one)| Some((one, json.get(sequence)?))).collect();
    assert!(!both.is_empty());
    for ((frame, _), (twin, _)) in both {
        assert_eq!(frame.objects.len(), twin.objects.len());
        for (one, other) in frame.objects.iter().zip(&twin.objects) {
            assert_eq!((one.track, &one.contributors), (other.track, &other.contributors));
            assert!((one.bev.x - other.bev.x).abs() < 1e-3);
        }
    }
    deltas.close().await?;
    tiles.close().await?;
    network.end().await?;
    Ok(())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_json_twins_say_the_same_as_the_compact_streams() -> anyhow::Result<()> {
    let network = Network::start_with(&format!("{PATIENT_HUB}\n{TILES}")).await?;
    let camera = network.agent("camera").join().await?;
    camera.play(traffic())?;
    let deltas = consumer(&network, Traffic::Delta).await?;
    let (keys, hub) = (Keys::new(network.id()), HubId::new("hub")?);
    let subscribe = async |key: String| {
        deltas.session().declare_subscriber(key).await.map_err(|error| anyhow!("{error}"))
    };
    let (twin, tiles) =
        (subscribe(keys.delta_json(&hub)).await?, subscribe(keys.all_tiles_json(&hub)).await?);
    let mut compact = BTreeMap::new();
    let mut is_same_delta = false;
    while !is_same_delta {
        let entry = next(&deltas).await?;
        if let ListUpdate::Delta(delta) = wire::decode_update(&entry.encoding, &entry.payload)? {
            compact.insert(delta.sequence, delta);
        }
        while let Ok(Some(sample)) = twin.try_recv() {
            let payload = sample.payload().to_bytes();
            let update = wire::decode_update(&sample.encoding().to_string(), &payload)?;
            if let ListUpdate::Delta(delta) = update
                && let Some(same) = compact.get(&delta.sequence)
            {
                assert_eq!((delta.key_sequence, &delta.gone), (same.key_sequence, &same.gone));
                assert_eq!(delta.changed.len(), same.changed.len());
                is_same_delta = true;
            }
        }
    }
    let sample = tokio::time::timeout(PATIENCE, tiles.recv_async()).await.context("no tile came")?;
    let sample = sample.map_err(|error| anyhow!("{error}"))?;
    wire::json::decode_fused(&sample.payload().to_bytes())?;
    let prefix = format!("v2x/{}/hub/hub/fused/json/tile/1/2/0/2/", network.id());
    assert!(sample.key_expr().as_str().starts_with(&prefix), "{}", sample.key_expr());
    drop((twin, tiles));
    deltas.close().await?;
    network.end().await?;
    Ok(())
}
