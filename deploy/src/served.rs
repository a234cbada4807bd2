//! Which hubs are there, whether they answer or not.

use std::collections::BTreeSet;
use std::time::Duration;
use v2x_common::id::{HubId, NetworkId};
use v2x_fusion_hub::hub::HubStatus;
use v2x_lab::loopback::{ConnectionError, hub_status};
use zenoh::Session;

/// Names from outside that are kept.
const MAX_HUBS: usize = 256;
/// How often a hub that is there is asked; each time it has two seconds.
const ASKED: u32 = 5;
/// Between two questions, so that an answer at once is none that costs.
const PAUSE: Duration = Duration::from_millis(200);

/// Hubs by their liveliness tokens, or by what they publish.
#[derive(Clone, Debug, Default)]
pub(crate) struct Served {
    hubs: BTreeSet<(NetworkId, HubId)>,
}

impl Served {
    /// By the tokens; none where they cannot be read.
    pub(crate) async fn of(session: &Session) -> Self {
        let mut served = Self::default();
        let Ok(replies) = session.liveliness().get("v2x/*/hub/*/alive").await else { return served };
        while let Ok(reply) = replies.recv_async().await {
            if let Ok(sample) = reply.into_result() {
                served.note(sample.key_expr().as_str());
            }
        }
        served
    }

    /// Takes in the key of a hub: its token's, or one under which it publishes.
    pub(crate) fn note(&mut self, key: &str) {
        let chunks: Vec<_> = key.split('/').collect();
        if let ["v2x", network, "hub", hub, _, ..] = chunks[..]
            && let (Ok(network), Ok(hub)) = (NetworkId::new(network), HubId::new(hub))
            && self.hubs.len() < MAX_HUBS
        {
            self.hubs.insert((network, hub));
        }
    }

    /// With those of another.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.hubs.extend(other.hubs.iter().copied());
    }

    /// The networks that have a hub.
    pub(crate) fn networks(&self) -> BTreeSet<NetworkId> {
        self.hubs.iter().map(|(network, _)| *network).collect()
    }

    /// The hubs of a network.
    pub(crate) fn hubs(&self, of: NetworkId) -> Vec<HubId> {
        self.hubs.iter().filter(|(network, _)| *network == of).map(|(_, hub)| *hub).collect()
    }

    /// Whether one that was asked for is there.
    pub(crate) fn has(&self, network: NetworkId, hub: Option<HubId>) -> bool {
        self.hubs(network).iter().any(|one| hub.is_none_or(|hub| hub == *one))
    }

    /// The hubs of a network in words.
    pub(crate) fn names(&self, network: NetworkId) -> String {
        let names: Vec<_> = self.hubs(network).iter().map(HubId::to_string).collect();
        let several = if names.len() > 1 { "hubs" } else { "hub" };
        format!("{several} {}", names.join(", "))
    }
}

/// The statuses of the hubs. One that is there and does not answer, as under a heavy load, is asked again for some seconds;
/// then there are none.
///
/// # Errors
/// Where a hub that is not known to be there answers with an error, or one with what cannot be read.
pub(crate) async fn statuses(
    session: &Session,
    (network, hub): (NetworkId, Option<HubId>),
    served: &Served,
    with_standby: bool,
) -> Result<Vec<HubStatus>, ConnectionError> {
    let is_there = served.has(network, hub);
    let asked = if is_there { ASKED } else { 1 };
    for n in 1..=asked {
        let found = match with_standby {
            true => hub_status::query_all(session, network, hub).await,
            false => hub_status::query_of(session, network, hub).await,
        };
        match found {
            // A question to which nobody answers in time is answered by our own session, with an error.
            Err(ConnectionError::Reply(_)) if is_there => {}
            Ok(found) if found.is_empty() && n < asked => {}
            found => return found,
        }
        if n < asked {
            tokio::time::sleep(PAUSE).await;
        }
    }
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hubs_are_known_by_their_tokens_and_by_their_lists() {
        let mut served = Served::default();
        [
            "v2x/demo/hub/north/alive",
            "v2x/demo/hub/south/fused",
            "v2x/other/hub/h/alive",
            "v2x/demo/agent/a/alive",
            "v2x/demo/hub",
        ]
        .iter()
        .for_each(|key| served.note(key));
        let demo = NetworkId::new("demo").unwrap();
        assert_eq!(served.names(demo), "hubs north, south");
        assert_eq!(served.networks().len(), 2);
        assert!(served.has(demo, None) && served.has(demo, Some(HubId::new("south").unwrap())));
        assert!(!served.has(demo, Some(HubId::new("h").unwrap())));
    }
}
