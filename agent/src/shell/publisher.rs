//! The Zenoh publishers of an agent.

use super::args::WireFormat;
use crate::sensor::Observation;
use anyhow::anyhow;
use std::time::Duration;
use v2x_common::id::AgentId;
use v2x_common::keys::Keys;
use v2x_common::sensor::SensorDescription;
use v2x_common::wire::{self, ENCODING_JSON, ENCODING_POSTCARD};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

/// The publishers and the liveliness token of an agent.
pub(super) struct AgentPublisher {
    detections: Publisher<'static>,
    sensor: Publisher<'static>,
    truth: Publisher<'static>,
    format: WireFormat,
    session: Session,
    // Dropping it undeclares it.
    _alive: LivelinessToken,
    /// While what the agent rides on is not in the world.
    idle: Option<LivelinessToken>,
}

impl AgentPublisher {
    pub(super) async fn declare(
        session: &Session,
        keys: &Keys,
        agent: &AgentId,
        format: WireFormat,
    ) -> zenoh::Result<Self> {
        let encoding = match format {
            WireFormat::Postcard => ENCODING_POSTCARD,
            WireFormat::Json => ENCODING_JSON,
        };
        let detections = session
            .declare_publisher(keys.detections(agent))
            .encoding(encoding)
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::DataHigh)
            .express(true);
        let sensor = session
            .declare_publisher(keys.sensor(agent))
            .encoding(encoding)
            // Published again each second: nobody who is slow to read may hold the agent up.
            .congestion_control(CongestionControl::Drop);
        let truth = session
            .declare_publisher(keys.truth(agent))
            .encoding(ENCODING_JSON)
            // Live data has priority: a frame whose truth is lost is not scored.
            .congestion_control(CongestionControl::Drop);
        Ok(Self {
            detections: detections.await?,
            sensor: sensor.await?,
            truth: truth.await?,
            format,
            session: session.clone(),
            idle: None,
            _alive: session.liveliness().declare_token(keys.agent_alive(agent)).await?,
        })
    }

    /// Waits until there is a subscriber of the detections, at most for `patience`: what is published earlier is lost.
    pub(super) async fn wait_for_subscriber(&self, patience: Duration) -> zenoh::Result<bool> {
        let listener = self.detections.matching_listener().await?;
        let matching = async {
            while !self.detections.matching_status().await?.matching() {
                listener.recv_async().await?;
            }
            Ok(())
        };
        match tokio::time::timeout(patience, matching).await {
            Ok(result) => result.map(|()| true),
            Err(_) => Ok(false),
        }
    }

    /// Whether somebody reads the detections, as far as this client is told.
    pub(super) async fn is_heard(&self) -> zenoh::Result<bool> {
        Ok(self.detections.matching_status().await?.matching())
    }

    /// Whether it has said that the agent sees nothing.
    pub(super) const fn is_idle(&self) -> bool {
        self.idle.is_some()
    }

    /// Says that the agent sees nothing, under this key, or that it sees again.
    pub(super) async fn say_idle(&mut self, key: Option<&str>) -> zenoh::Result<()> {
        match (key, self.idle.is_some()) {
            (Some(key), false) => {
                self.idle = Some(self.session.liveliness().declare_token(key.to_owned()).await?);
            }
            (None, true) => self.idle = None,
            _ => {}
        }
        Ok(())
    }

    pub(super) async fn put_description(&self, description: &SensorDescription) -> anyhow::Result<()> {
        let payload = match self.format {
            WireFormat::Postcard => {
                let mut payload = Vec::new();
                wire::sensor::encode(description, &mut payload)?;
                payload
            }
            WireFormat::Json => wire::json::encode_sensor(description)?,
        };
        self.sensor.put(payload).await.map_err(|error| anyhow!("{error}"))
    }

    /// Publishes the frame, and after it the identities of its detections on their own key.
    pub(super) async fn put_observation(&self, observation: &Observation) -> anyhow::Result<()> {
        let payload = match self.format {
            WireFormat::Postcard => {
                let mut payload = Vec::with_capacity(512);
                wire::detections::encode(&observation.frame, &mut payload)?;
                payload
            }
            WireFormat::Json => wire::json::encode_detections(&observation.frame)?,
        };
        let truth = serde_json::to_vec(&observation.identities)?;
        self.detections.put(payload).await.map_err(|error| anyhow!("{error}"))?;
        self.truth.put(truth).await.map_err(|error| anyhow!("{error}"))
    }
}
