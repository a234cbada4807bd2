//! Publishers of what is made only while somebody subscribes.

use anyhow::anyhow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use v2x_common::id::HubId;
use v2x_common::keys::Keys;
use v2x_common::tile::Tile;
use v2x_common::wire::{ENCODING_JSON, ENCODING_POSTCARD};
use zenoh::Session;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

/// A publisher that knows whether it has subscribers.
pub(super) struct OnDemand {
    publisher: Publisher<'static>,
    is_wanted: Arc<AtomicBool>,
}

impl OnDemand {
    pub(super) async fn declare(
        session: &Session,
        key: String,
        encoding: &'static str,
    ) -> zenoh::Result<Self> {
        Self::of(declare_publisher(session, key, encoding).await?).await
    }

    /// Of what is of use as a whole only: it waits behind the newest lists, in a longer queue for each consumer
    /// (`v2x_common::net::session::hub_options`), before any of it is dropped.
    pub(super) async fn declare_whole(
        session: &Session,
        key: String,
        encoding: &'static str,
    ) -> zenoh::Result<Self> {
        let publisher = session.declare_publisher(key).encoding(encoding);
        let publisher = publisher.congestion_control(CongestionControl::Drop).priority(Priority::Data);
        Self::of(publisher.await?).await
    }

    async fn of(publisher: Publisher<'static>) -> zenoh::Result<Self> {
        let is_wanted = Arc::new(AtomicBool::new(false));
        let wanted = is_wanted.clone();
        publisher
            .matching_listener()
            .callback(move |status| wanted.store(status.matching(), Ordering::Relaxed))
            .background()
            .await?;
        Ok(Self { publisher, is_wanted })
    }

    /// Whether somebody subscribes.
    pub(super) fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::Relaxed)
    }

    pub(super) async fn put(&self, bytes: Vec<u8>) -> anyhow::Result<()> {
        self.publisher.put(bytes).await.map_err(|error| anyhow!("{error}"))
    }
}

/// The publishers of a hub's tiles in one codec.
pub(super) struct Tiles {
    session: Session,
    /// On all tiles, and only to know whether any has subscribers: a sample on it would reach all of them.
    any: OnDemand,
    encoding: &'static str,
}

impl Tiles {
    pub(super) async fn declare(
        session: &Session,
        key: String,
        encoding: &'static str,
    ) -> zenoh::Result<Self> {
        let any = OnDemand::declare(session, key, encoding).await?;
        Ok(Self { session: session.clone(), any, encoding })
    }

    /// Whether somebody subscribes to any tile.
    pub(super) fn is_wanted(&self) -> bool {
        self.any.is_wanted()
    }

    /// Puts the frame of the tile with this key.
    pub(super) async fn put(&self, key: String, bytes: Vec<u8>) -> anyhow::Result<()> {
        self.session
            .put(key, bytes)
            .encoding(self.encoding)
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::DataHigh)
            .express(true)
            .await
            .map_err(|error| anyhow!("{error}"))
    }
}

/// The publishers of the lists that cost less than the whole one.
pub(super) struct Parts {
    keys: Keys,
    hub: HubId,
    pub(super) delta: OnDemand,
    pub(super) delta_json: OnDemand,
    pub(super) tiles: Tiles,
    pub(super) tiles_json: Tiles,
}

impl Parts {
    pub(super) async fn declare(session: &Session, keys: Keys, hub: HubId) -> zenoh::Result<Self> {
        Ok(Self {
            delta: OnDemand::declare(session, keys.delta(&hub), ENCODING_POSTCARD).await?,
            delta_json: OnDemand::declare(session, keys.delta_json(&hub), ENCODING_JSON).await?,
            tiles: Tiles::declare(session, keys.all_tiles(&hub), ENCODING_POSTCARD).await?,
            tiles_json: Tiles::declare(session, keys.all_tiles_json(&hub), ENCODING_JSON).await?,
            keys,
            hub,
        })
    }

    /// The keys of a tile, postcard and JSON.
    pub(super) fn keys_of(&self, tile: Tile) -> [String; 2] {
        [self.keys.tile(&self.hub, tile), self.keys.tile_json(&self.hub, tile)]
    }
}

pub(super) async fn declare_publisher(
    session: &Session,
    key: String,
    encoding: &'static str,
) -> zenoh::Result<Publisher<'static>> {
    session
        .declare_publisher(key)
        .encoding(encoding)
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::DataHigh)
        .express(true)
        .await
}
