//! The status query.

use crate::loopback::connection_error::ConnectionError;
use v2x_common::id::NetworkId;
use v2x_common::keys::Keys;
use v2x_fusion_hub::hub::HubStatus;
use zenoh::Session;

/// The status of each hub of a network that publishes and replies.
pub async fn query(session: &Session, network: NetworkId) -> Result<Vec<HubStatus>, ConnectionError> {
    let mut statuses = query_all(session, network).await?;
    statuses.retain(|status| status.standby.as_ref().is_none_or(|standby| standby.publishes));
    Ok(statuses)
}

/// The same, and of those that stand by.
pub async fn query_all(session: &Session, network: NetworkId) -> Result<Vec<HubStatus>, ConnectionError> {
    let keys = Keys::new(network);
    let replies = session.get(keys.all_status()).await.map_err(ConnectionError::Query)?;
    let mut statuses = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        let sample = reply.into_result().map_err(|error| ConnectionError::Reply(error.to_string().into()))?;
        statuses.push(serde_json::from_slice(&sample.payload().to_bytes())?);
    }
    Ok(statuses)
}
