//! Asking hubs how they fare.

use anyhow::{Context, anyhow};
use v2x_common::id::NetworkId;
use v2x_common::keys::Keys;
use v2x_fusion_hub::hub::HubStatus;
use zenoh::Session;

/// The status of every hub of a network that answers.
pub async fn query(session: &Session, network: NetworkId) -> anyhow::Result<Vec<HubStatus>> {
    let keys = Keys::new(network);
    let replies =
        session.get(keys.all_status()).await.map_err(|error| anyhow!("asking for the status: {error}"))?;
    let mut statuses = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        let sample = reply.into_result().map_err(|error| anyhow!("a hub answered with an error: {error}"))?;
        let status = serde_json::from_slice(&sample.payload().to_bytes());
        statuses.push(status.context("a hub's status is of another version")?);
    }
    Ok(statuses)
}
