//! The status query.

use crate::loopback::connection_error::ConnectionError;
use v2x_common::id::{HubId, NetworkId};
use v2x_common::keys::Keys;
use v2x_common::wire::Writings;
use v2x_fusion_hub::hub::HubStatus;
use zenoh::Session;

/// The status of each hub of a network that publishes and replies.
pub async fn query(session: &Session, network: NetworkId) -> Result<Vec<HubStatus>, ConnectionError> {
    query_of(session, network, None).await
}

/// The same, of this hub alone where one is given.
pub async fn query_of(
    session: &Session,
    network: NetworkId,
    hub: Option<HubId>,
) -> Result<Vec<HubStatus>, ConnectionError> {
    let mut statuses = query_all(session, network, hub).await?;
    statuses.retain(|status| status.standby.as_ref().is_none_or(|standby| standby.publishes));
    Ok(statuses)
}

/// How agents write, by the first hub by its name that says anything of it; `None` where no hub answers.
pub async fn writings(
    session: &Session,
    network: NetworkId,
    hub: Option<HubId>,
) -> Result<Option<Writings>, ConnectionError> {
    Ok(writings_of(&query_of(session, network, hub).await?))
}

/// The same of hubs that have answered.
pub fn writings_of(hubs: &[HubStatus]) -> Option<Writings> {
    let mut hubs: Vec<_> = hubs.iter().collect();
    hubs.sort_by_key(|hub| (hub.writings.is_empty(), hub.hub));
    Some(Writings::new(hubs.first()?.writings.clone()))
}

/// The same, and of those that stand by. Of one hub alone nobody else is asked, so that nobody else can answer for it where
/// an access control knows who may.
pub async fn query_all(
    session: &Session,
    network: NetworkId,
    hub: Option<HubId>,
) -> Result<Vec<HubStatus>, ConnectionError> {
    let keys = Keys::new(network);
    let asked = match &hub {
        Some(hub) => vec![keys.status(hub), keys.all_standby_status(hub)],
        None => vec![keys.all_status()],
    };
    let mut statuses = Vec::new();
    for asked in asked {
        let replies = session.get(asked).await.map_err(ConnectionError::Query)?;
        while let Ok(reply) = replies.recv_async().await {
            let sample =
                reply.into_result().map_err(|error| ConnectionError::Reply(error.to_string().into()))?;
            let status: HubStatus = serde_json::from_slice(&sample.payload().to_bytes())?;
            let key = sample.key_expr().as_str();
            // Under the keys of those that stand by nobody answers who does not.
            let is_its = !key.contains('~') || status.standby.is_some();
            if is_its && hub.is_none_or(|hub| hub == status.hub) && keys.is_status_of(&status.hub, key) {
                statuses.push(status);
            } else {
                tracing::warn!(key, hub = %status.hub, "an answer in the name of another hub is not used");
            }
        }
    }
    Ok(statuses)
}
