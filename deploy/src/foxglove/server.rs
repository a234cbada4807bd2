//! Serves what is on a network over Foxglove's WebSocket: scenes to look at, and fused lists as JSON to plot.

use anyhow::{Context as _, anyhow};
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry as Place;
use std::io::Write;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::keys::Topic;
use v2x_common::net::session::SessionOptions;
use v2x_common::recording::{Entry, SCENE_SCHEMA, SCENE_SCHEMA_NAME, Scene, Scenes};
use v2x_common::time::{Span, Timestamp};
use v2x_common::{schemas, wire};
use v2x_lab::loopback::consumer::{Consumer, Subscription, Traffic};
use v2x_lab::loopback::hub_status;

/// Least time between two scenes of an agent or a hub: as often as people see it.
const SCENE_EVERY: Span = Span::from_millis(50);
/// Time between two questions for the status, which says how agents write.
const STATUS_EVERY: Duration = Duration::from_secs(5);
/// Samples that may wait while the newest ones are translated.
const CAPACITY: usize = 1024;
/// Viewers may come before a hub does: ten years.
const PATIENCE: Duration = Duration::from_secs(10 * 365 * 86_400);
/// Topics beyond this have no channel: names come from the network.
const MAX_CHANNELS: usize = 1024;

/// Serves until shutdown.
pub(crate) async fn serve(
    address: SocketAddr,
    session: &SessionOptions,
    (network, hub): (NetworkId, Option<HubId>),
    shutdown: &CancellationToken,
) -> anyhow::Result<()> {
    let context = Context::new();
    let server = WebSocketServer::new().name(format!("v2x {network}")).context(&context);
    let server = server
        .bind(address.ip().to_string(), address.port())
        .start()
        .await
        .with_context(|| format!("serving Foxglove's viewers at {address}; port 0 takes any free one"))?;
    announce(SocketAddr::new(address.ip(), server.port()));
    let subscription = Subscription { network, traffic: Traffic::Everything, hub, capacity: CAPACITY };
    if let Some(consumer) = Consumer::connect(session, subscription, PATIENCE, shutdown).await? {
        let mut channels = Channels::new(context);
        let mut status = tokio::time::interval(STATUS_EVERY);
        status.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                biased;
                () = shutdown.cancelled() => break,
                _ = status.tick() => {
                    if let Ok(Some(writings)) = hub_status::writings(consumer.session(), network, hub).await {
                        channels.scenes.read_by(writings);
                    }
                }
                entry = consumer.next() => channels.show(&entry),
            }
        }
        consumer.close().await?;
    }
    server.stop().wait().await;
    Ok(())
}

/// Prints where the viewers connect.
fn announce(address: SocketAddr) {
    let mut err = std::io::stderr().lock();
    let _ =
        writeln!(err, "Foxglove: open the connection ws://{address} (Foxglove WebSocket), and a 3D panel");
    if !address.ip().is_loopback() {
        let _ = writeln!(err, "everybody who reaches this address can watch; there is no password");
    }
}

/// The channels that viewers see, by topic.
struct Channels {
    context: Arc<Context>,
    by_topic: BTreeMap<String, Arc<RawChannel>>,
    scenes: Scenes,
}

impl Channels {
    fn new(context: Arc<Context>) -> Self {
        Self { context, by_topic: BTreeMap::new(), scenes: Scenes::new(SCENE_EVERY) }
    }

    /// Shows a sample to the viewers that want it.
    fn show(&mut self, entry: &Entry) {
        if let Some(Scene { topic, json }) = self.scenes.of(entry) {
            let schema = || Schema::new(SCENE_SCHEMA_NAME, "jsonschema", SCENE_SCHEMA.as_bytes());
            self.send(topic, schema, (entry.received_at, &json));
        }
        if matches!(Topic::of(&entry.key), Some(Topic::Fused(_))) {
            match wire::fused::decode(&entry.payload).and_then(|frame| wire::json::encode_fused(&frame)) {
                Ok(json) => {
                    let schema =
                        || Schema::new("v2x.FusedFrame", "jsonschema", schemas::FUSED_FRAME.as_bytes());
                    self.send(entry.key.clone(), schema, (entry.received_at, &json));
                }
                Err(error) => tracing::debug!(key = entry.key, %error, "a list that cannot be shown"),
            }
        }
    }

    fn send(&mut self, topic: String, schema: impl FnOnce() -> Schema, (at, json): (Timestamp, &[u8])) {
        let is_full = self.by_topic.len() >= MAX_CHANNELS;
        let channel = match self.by_topic.entry(topic) {
            Place::Occupied(place) => place.into_mut(),
            Place::Vacant(place) if !is_full => {
                let builder = ChannelBuilder::new(place.key().clone()).context(&self.context);
                match builder.message_encoding("json").schema(schema()).build_raw() {
                    Ok(channel) => place.insert(channel),
                    Err(error) => {
                        tracing::warn!(topic = place.key(), error = %anyhow!(error), "no channel for viewers");
                        return;
                    }
                }
            }
            Place::Vacant(_) => return,
        };
        let log_time = u64::try_from(at.as_nanos()).ok();
        channel.log_with_meta(json, PartialMetadata { log_time });
    }
}
