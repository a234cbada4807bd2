//! Another hub that publishes under this hub's name. Consumers would get the lists of both in turn.
//!
//! A hub that joins a network in which one of its name answers does not begin. Two that come together later, because their
//! routers are joined, are told. Neither of them yields: without certificates anybody can claim the name of a hub, and would
//! silence it so.

use super::status::HubStatus;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use v2x_common::clock;
use v2x_common::id::HubId;
use v2x_common::keys::Keys;
use v2x_common::time::{Span, Timestamp};
use v2x_common::wire;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Locality;

/// How long another hub has for its answer.
const ANSWER_WITHIN: Duration = Duration::from_millis(500);
/// A list is looked into this often at most: anybody can publish some.
const LOOKED_AT_EVERY: Span = Span::from_millis(500);
/// It is told of for so long after its last list.
const TOLD_FOR: Span = Span::from_millis(5_000);

/// What was heard under this hub's own key.
#[derive(Debug, Default)]
pub(super) struct Twin(Mutex<Heard>);

#[derive(Debug, Default)]
struct Heard {
    looked_at: Option<Timestamp>,
    /// The lineage of another hub's list, and when it came.
    other: Option<(u32, Timestamp)>,
}

impl Twin {
    /// Takes in a list that another session put under this hub's key.
    fn note(&self, payload: &[u8], now: Timestamp) {
        let mut heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if heard.looked_at.is_some_and(|at| now - at < LOOKED_AT_EVERY) {
            return;
        }
        heard.looked_at = Some(now);
        if let Ok(frame) = wire::fused::decode(payload) {
            heard.other = Some((frame.lineage, now));
        }
    }

    /// The lineage of another hub of this name, while it publishes.
    pub(super) fn lineage(&self, now: Timestamp) -> Option<u32> {
        let heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        heard.other.filter(|(_, at)| now - *at < TOLD_FOR).map(|(lineage, _)| lineage)
    }
}

/// Listens to the hub's own key; what it puts itself is left out.
pub(super) async fn listen(
    session: &Session,
    keys: &Keys,
    hub: &HubId,
    twin: std::sync::Arc<Twin>,
) -> zenoh::Result<Subscriber<()>> {
    let others = session.declare_subscriber(keys.fused(hub)).allowed_origin(Locality::Remote);
    others.callback(move |sample| twin.note(&sample.payload().to_bytes(), clock::now())).await
}

/// The hub of this name that answers in the network, if there is one.
pub(super) async fn running(session: &Session, keys: &Keys, hub: &HubId) -> Option<HubStatus> {
    let replies = session.get(keys.status(hub)).timeout(ANSWER_WITHIN).await.ok()?;
    while let Ok(reply) = replies.recv_async().await {
        if let Ok(sample) = reply.into_result()
            && let Ok(status) = serde_json::from_slice(&sample.payload().to_bytes())
        {
            return Some(status);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use v2x_common::fused::FusedFrame;

    #[test]
    fn another_hubs_list_is_told_of_while_it_comes_and_rubbish_is_not() {
        let twin = Twin::default();
        let at = |ms: i64| Timestamp::EPOCH + Span::from_millis(ms);
        twin.note(b"rubbish", at(0));
        assert_eq!(twin.lineage(at(1)), None);
        let list = FusedFrame {
            hub: HubId::new("hub").unwrap(),
            lineage: 7,
            sequence: 1,
            fused_at: at(0),
            map_frame: None,
            objects: Vec::new(),
            agents: Vec::new(),
            includes: Vec::new(),
        };
        let mut bytes = Vec::new();
        wire::fused::encode(&list, &mut bytes).unwrap();
        twin.note(&bytes, at(1000));
        assert_eq!((twin.lineage(at(5999)), twin.lineage(at(6000))), (Some(7), None));
    }
}
