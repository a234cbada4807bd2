//! The connection of an agent to its network.

use crate::loopback::access::Access;
use crate::loopback::error::KitError;
use anyhow::anyhow;
use std::time::Duration;
use v2x_common::id::AgentId;
use v2x_common::keys::Keys;
use v2x_common::net::session;
use v2x_common::sensor::SensorDescription;
use v2x_common::wire::{self, ENCODING_POSTCARD};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;

/// Time limit for the hub in this process to subscribe.
const PATIENCE: Duration = Duration::from_secs(20);

/// The session of a client with its publishers.
pub(super) struct Connection {
    session: Session,
    detections: Publisher<'static>,
    sensor: Publisher<'static>,
    description: Option<Vec<u8>>,
    // Dropping it undeclares it.
    alive: LivelinessToken,
}

impl Connection {
    /// Time between two sensor descriptions.
    pub(super) const DESCRIPTION_INTERVAL: Duration = Duration::from_secs(1);

    /// Connects, waits until the hub has subscribed, and publishes the sensor description.
    pub(super) async fn open(
        access: &Access,
        agent: AgentId,
        description: Option<SensorDescription>,
    ) -> Result<Self, KitError> {
        let description = description.map(|description| {
            let mut payload = Vec::new();
            let encoded = wire::sensor::encode(&description, &mut payload);
            encoded.map(|()| payload).map_err(|source| KitError::Frame { agent, source })
        });
        let description = description.transpose()?;
        let config = session::client_config(&access.session).map_err(KitError::Zenoh)?;
        let session = session::open(config).await.map_err(KitError::Zenoh)?;
        let keys = Keys::new(access.network);
        let declared = async {
            let detections = session.declare_publisher(keys.detections(&agent)).encoding(ENCODING_POSTCARD);
            let detections = detections.congestion_control(CongestionControl::Block).express(true).await?;
            let sensor = session.declare_publisher(keys.sensor(&agent)).encoding(ENCODING_POSTCARD);
            let sensor = sensor.congestion_control(CongestionControl::Block).await?;
            let alive = session.liveliness().declare_token(keys.agent_alive(&agent)).await?;
            Ok::<_, zenoh::Error>((detections, sensor, alive))
        };
        let (detections, sensor, alive) = declared.await.map_err(|error| zenoh_error(&error))?;
        let heard = tokio::time::timeout(PATIENCE, subscribed(&detections)).await;
        heard
            .map_err(|_| KitError::NotHeard { agent, patience: PATIENCE })?
            .map_err(|error| zenoh_error(&error))?;
        Ok(Self { session, detections, sensor, description, alive })
    }

    /// Puts a frame.
    pub(super) async fn put(&self, payload: Vec<u8>) -> zenoh::Result<()> {
        self.detections.put(payload).await
    }

    /// Publishes the sensor description, if there is one.
    pub(super) async fn describe(&self) -> zenoh::Result<()> {
        match &self.description {
            Some(payload) => self.sensor.put(payload.clone()).await,
            None => Ok(()),
        }
    }

    /// Leaves the network.
    pub(super) async fn close(self) {
        let Self { session, detections, sensor, alive, .. } = self;
        drop((detections, sensor, alive));
        if let Err(error) = session::close(session).await {
            tracing::debug!(%error, "an agent did not leave in order");
        }
    }
}

/// Waits for a subscriber: a message that is put before is lost.
async fn subscribed(publisher: &Publisher<'_>) -> zenoh::Result<()> {
    let listener = publisher.matching_listener().await?;
    while !publisher.matching_status().await?.matching() {
        listener.recv_async().await?;
    }
    Ok(())
}

fn zenoh_error(error: &zenoh::Error) -> KitError {
    KitError::Zenoh(anyhow!("{error}"))
}
